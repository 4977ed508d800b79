"""outcam1.prn and outcam2.prn: calb's calibration of a camera, read by back and locate.

A header of 15 lines, then r1 r2 r3, r4 r5 r6, r7 r8 r9; Tx Ty Tz; Sx f K1 (15 decimals); the largest distance between
points and the two points, numbered from 1 in the order of cam1.prn (not by tag). c = R p + T in the unit of the survey;
f, K1 in mm and 1/mm2; Cx, Cy and the sensor are in camparm.dat.

What appendix C computes is not what chapter 4 says, and is read as it was meant to project:

- K1: calb solves, and back and locate use, Xu = Xd / (1 + K1 Rd^2), where equation 4.4.6 multiplies: K1 has the other
  sign. kappa1 = -K1, kappa2 = K1^2, kappa3 = -K1^3 are the same lens to 1e-8 of the radius.
- Sx: back projects as Tsai does, Xf = Sx Xd / dx + Cx; to locate, back and locate use Xd = Sx dx (Xf - Cx) where Tsai
  divides ("potential bug 1/S.x"), and calb solves f and K1 with Sx = 1. Positions are located here by Tsai's equation.
- r1 r2 r3 and r4 r5 r6 are unit vectors, not quite square to each other: what their angle lacks of 90 degrees becomes
  the skew of the camera, so that it projects as back does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.dlt import decomposed
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path
from vidtrack.exchange.thesis.camparm import Fixed
from vidtrack.exchange.thesis.header import body_of, header, row
from vidtrack.files.atomic import replacing
from vidtrack.geometry.camera import (
    Camera,
    distorted_from_frame_buffer,
    project,
    straightened,
    undistorted_from_frame_buffer,
)
from vidtrack.geometry.lens_terms import RADIAL


class Outcam(NamedTuple):
    """A whole file: R (3, 3) as calb has it, T (3,) world units, and the rest in the file's order."""

    R: Array
    T: Array
    Sx: float
    f: float
    kappa1: float
    longest: float = np.nan
    ends: tuple[int, int] = (0, 0)


def read_outcam(path: Path) -> Outcam:
    """Read outcam1.prn."""
    body = body_of(path, "calibration")
    rows = [row(path, line, text, 3, "this line of a calibration") for line, text in body[:5]]
    if len(rows) < 5:
        raise VidtrackError(f"{path}: {len(rows)} of the five lines R, T and Sx f K1. Copy the whole file again.")
    last = row(path, *body[5], 1, "the longest distance") if len(body) > 5 else [np.nan]
    ends = (int(last[1]), int(last[2])) if len(last) > 2 else (0, 0)
    R, T = np.array([found[:3] for found in rows[:3]]), np.array(rows[3][:3])
    Sx, f, kappa1 = rows[4][:3]
    if not (f > 0 and Sx > 0):
        raise VidtrackError(
            f"{path}: f {f:g} and Sx {Sx:g} must be positive: calb failed. Calibrate from cam1.prn again."
        )
    if not np.allclose(np.linalg.det(R), 1, atol=0.05):
        raise VidtrackError(
            f"{path}: the determinant of R is {np.linalg.det(R):.3f}, not 1: calb failed. Calibrate from cam1.prn "
            "again."
        )
    return Outcam(R, T, Sx, f, kappa1, last[0], ends)


def write_outcam(path: Path, out: Outcam, name: str = "outcam1.prn") -> None:
    """Write outcam1.prn as back and locate read it."""
    text = (
        "This is an intermediate calibration file for use with",
        "back.exe, and locate.exe",
        " r1          r2          r3",
        " r4          r5          r6",
        " r7          r8          r9",
        " Tx          Ty          Tz",
        " Sx          f           K1",
        " Max dist between      PointA      PointB",
    )

    def line(values: Array | tuple[float, ...]) -> str:
        return "\t".join(f"{value:5.15f}" for value in values) + "\n"

    body = "".join(line(each) for each in out.R) + "\n" + line(out.T) + "\n" + line((out.Sx, out.f, out.kappa1))
    longest = 0.0 if np.isnan(out.longest) else out.longest
    body += f"\n\t{longest:f}\t\t{out.ends[0]}\t\t{out.ends[1]}\n"
    with replacing(path) as file:
        file.write((header(name, text, height=15) + body).encode())


def camera_of(out: Outcam, fixed: Fixed, name: str = "") -> Camera:
    """The camera that projects as back does with this calibration."""
    A = np.array([[out.f * out.Sx / fixed.dx, 0, fixed.Cx], [0, out.f / fixed.dy, fixed.Cy], [0, 0, 1]])
    P = A @ np.column_stack([out.R, out.T])
    K, R, T, _ = decomposed(P / np.linalg.norm(P[2, :3]))
    f = K[1, 1] * fixed.dy
    return Camera(
        Cx=float(K[0, 2]),
        Cy=float(K[1, 2]),
        dx=fixed.dx,
        dy=fixed.dy,
        Sx=float(K[0, 0] * fixed.dx / f),
        f=float(f),
        kappa1=-out.kappa1,
        kappa2=out.kappa1**2,
        kappa3=-(out.kappa1**3),
        skew=float(K[0, 1] * fixed.dx / f),
        R=R,
        T=T,
        image_size=fixed.image_size,
        name=name,
    )


class Written(NamedTuple):
    """What calb would have written of a camera. worst_px: by how much K1 misses its lens, at most, in the picture."""

    out: Outcam
    fixed: Fixed
    worst_px: float


def outcam_of(camera: Camera, points: Array | None = None) -> Written:
    """What calb would have written of a camera; VidtrackError where its lens has terms that are not radial.

    points  (n, 3) world: for the longest distance
    K1 is the least-squares one over the picture.
    """
    if rest := [name for name in camera.lens if name not in RADIAL]:
        raise VidtrackError(f"camera {camera.name}: {rest[0]} is not known to calb. Calibrate with model: tsai.")
    if camera.projection != "perspective" or abs(camera.skew) > 1e-12:
        raise VidtrackError(f"camera {camera.name}: its lens model is not calb's. Calibrate with model: tsai.")
    width, height = camera.image_size
    size = camera.dx * width, camera.dy * height
    fixed = Fixed(width, height, width, camera.Cx, camera.Cy, *size)
    longest, ends = np.nan, (0, 0)
    if points is not None and len(points) > 1:
        apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
        i, j = np.unravel_index(np.argmax(apart), apart.shape)
        longest, ends = float(apart[i, j]), (int(i) + 1, int(j) + 1)
    K1, worst = _division(camera)
    return Written(Outcam(camera.R, camera.T, camera.Sx, camera.f, K1, longest, ends), fixed, worst)


def nearest(camera: Camera, points: Array | None = None) -> Written:
    """As `outcam_of`, of a lens with any terms: f, Sx, Cx, Cy and K1 come nearest to it over the picture, in px.

    VidtrackError for a wide lens, and for a camera that looks through interfaces.
    """
    if camera.projection != "perspective" or camera.through:
        raise VidtrackError(f"camera {camera.name}: its lens is wide or behind interfaces. Calibrate with model: tsai.")
    radial = dict.fromkeys((name for name in camera.lens if name not in RADIAL), 0.0)
    start = outcam_of(camera.with_(**radial, skew=0.0), points)
    from scipy.optimize import least_squares

    b = _grid(camera)
    rays = undistorted_from_frame_buffer(camera, b) / camera.f
    seen = np.isfinite(rays).all(-1)
    p, b = np.column_stack([rays[seen], np.ones(seen.sum())]), b[seen]
    scale = np.array([start.out.f, start.out.Sx, 1.0, 1.0, 1 / (camera.dx * camera.image_size[0]) ** 2])
    first = np.array([start.out.f, start.out.Sx, start.fixed.Cx, start.fixed.Cy, start.out.kappa1])

    def at(values: Array) -> tuple[Outcam, Fixed]:
        f, Sx, Cx, Cy, K1 = (first + values * scale).tolist()
        return start.out._replace(f=f, Sx=Sx, kappa1=K1), start.fixed._replace(Cx=Cx, Cy=Cy)

    def off(values: Array) -> Array:
        out, fixed = at(values)
        here = camera_of(out._replace(R=np.eye(3), T=np.array([0, 0, 1e-12])), fixed)
        return np.asarray(np.nan_to_num(project(here, p) - b, nan=1e3).ravel())

    best = least_squares(off, np.zeros(5), xtol=1e-12, ftol=1e-12, max_nfev=40)
    return Written(*at(best.x), float(np.linalg.norm(best.fun.reshape(-1, 2), axis=-1).max()))


def _grid(camera: Camera) -> Array:
    width, height = camera.image_size
    X, Y = np.meshgrid(np.linspace(-0.5, width - 0.5, 33), np.linspace(-0.5, height - 0.5, 33))
    return np.stack([X.ravel(), Y.ravel()], -1)


def _division(camera: Camera) -> tuple[float, float]:
    """K1 of Xu = Xd / (1 + K1 Rd^2) over the picture, and by how many px it misses the lens there at most."""
    d = distorted_from_frame_buffer(camera, _grid(camera))
    rd = np.hypot(d[..., 0], d[..., 1])
    ru = np.linalg.norm(straightened(camera, d), axis=-1)
    seen = np.isfinite(ru)
    rd, ru = rd[seen], ru[seen]
    slope = ru * rd * rd
    K1 = float(((rd - ru) * slope).sum() / (slope * slope).sum())
    miss = np.abs(rd / (1 + K1 * rd * rd) - ru)
    return K1, float(miss.max() / min(camera.dx, camera.dy))

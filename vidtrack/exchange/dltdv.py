"""DLTdv 8, DLTdv 7 and Argus: digitised points, points in space and DLT coefficients.

Source: DLTdv8a.mlapp 8.4 (its export and its dlt_reconstruct_v2, rrmse), DLTdv7.m (pictures turned over by flipud),
Argus's DLCclicker.py and tools.py.

| | DLTdv 8 | DLTdv 7 | Argus |
|---|---|---|---|
| origin of pixels | upper left, v down | lower left, v up | lower left, y up |
| centre of the top-left pixel | (1, 1) | (1, height) | (0, height) |
| columns of xypts | <name>_cam1_U, _V | pt1_cam1_X, _Y (numbered) | <name>_cam_1_x, _y |
| files | <run>_xypts.csv ... | the same | <run>-xypts.csv ... |

axes, units     the world's; xyz in the experiment's unit
rows            frames of camera 1, from its first; offsets.csv has each camera's count of frames less that of camera 1
lens            DLT has none: dltcoefs.csv (11 rows, a column a camera) belongs to undistorted_xypts.csv; xypts.csv lies
                on the pictures as they are. A note says how far the two are apart
missing         NaN
camera profile  Argus: camera f w h cx cy aspect k1 k2 t1 t2 k3, px from the centre of the top-left pixel, y down; one f
                (that of the columns) for both directions, as its undistort_pts has it
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.digitised import coefficients, digitised, without_lens
from vidtrack.exchange.ideal_to_distorted import GRID
from vidtrack.exchange.measured import Run, Written
from vidtrack.geometry.camera import Camera

Names = Callable[[int, str, int], tuple[str, str]]
"""Columns of a point, of its number from 1, its name, and the number of a camera."""


def write_dltdv8(run: Run) -> Written:
    """The files of DLTdv 8."""
    return _written(run, upper_left, lambda i, name, c: (f"{name}_cam{c}_U", f"{name}_cam{c}_V"), "_")


def write_dltdv7(run: Run) -> Written:
    """The files of DLTdv 5 to 7: points have numbers there, and the notes say which target each is."""
    return _written(run, lower_left, lambda i, name, c: (f"pt{i}_cam{c}_X", f"pt{i}_cam{c}_Y"), "_", numbered=True)


def write_argus(run: Run) -> Written:
    """The files of Argus, and its camera profile."""
    made = _written(run, argus, lambda i, name, c: (f"{name}_cam_{c}_x", f"{name}_cam_{c}_y"), "-")
    text, notes = _profile(digitised(run).cameras)
    files = made.files | {f"{run.name}-camera-profile.txt": text.encode()}
    return Written(files, made.notes + notes)


def upper_left(camera: Camera) -> Array:
    """From frame buffer px to DLTdv 8's, (3, 3)."""
    return np.array([[1.0, 0, 1], [0, 1, 1], [0, 0, 1]])


def lower_left(camera: Camera) -> Array:
    """From frame buffer px to those of DLTdv 7, (3, 3)."""
    return np.array([[1.0, 0, 1], [0, -1, camera.image_size[1]], [0, 0, 1]])


def argus(camera: Camera) -> Array:
    """From frame buffer px to Argus's, (3, 3)."""
    return np.array([[1.0, 0, 0], [0, -1, camera.image_size[1]], [0, 0, 1]])


def _written(
    run: Run, picture: Callable[[Camera], Array], names: Names, joint: str, *, numbered: bool = False
) -> Written:
    own = digitised(run)
    pictures = [picture(camera) for camera in own.cameras]
    raw, flat = _in_pictures(own.b, pictures), _in_pictures(own.flat, pictures)
    points = [f"pt{i}" if numbered else name for i, name in enumerate(own.names, 1)]
    if bad := [name for name in points if any(c in name for c in ',"\r\n')]:
        raise VidtrackError(f"run {run.name}: the name {bad[0]!r} has a comma, a quote or a line break. Rename it.")
    cams = range(1, len(own.cameras) + 1)
    columns = [column for i, name in enumerate(points, 1) for c in cams for column in names(i, name, c)]
    coefs = np.stack([coefficients(camera, at) for camera, at in zip(own.cameras, pictures, strict=True)], -1)
    rows = len(own.xyz)
    xyz = [f"{name}_{a}" for name in points for a in ("xyz" if joint == "-" else "XYZ")]
    start = f"{run.name}{joint}"
    files = {
        f"{start}xypts.csv": _csv(columns, raw.reshape(rows, -1)),
        f"{start}undistorted_xypts.csv": _csv(columns, flat.reshape(rows, -1)),
        f"{start}xyzpts.csv": _csv(xyz, own.xyz.reshape(rows, -1)),
        f"{start}xyzres.csv": _csv([f"{name}_dltres" for name in points], _residuals(coefs, flat, own.xyz)),
        f"{start}offsets.csv": _csv([f"cam{c}_offset" for c in cams], np.tile(own.offsets.astype(float), (rows, 1))),
        f"{start}dltcoefs.csv": _csv([], coefs),
    }
    called = [f"pt{i} is {name}" for i, name in enumerate(own.names, 1)] if numbered else []
    return Written(files, own.notes + called)


def _in_pictures(b: Array, pictures: list[Array]) -> Array:
    """Frame buffer px (n, m, c, 2) in each camera's picture of the program."""
    moved = [b[:, :, c] @ at[:2, :2].T + at[:2, 2] for c, at in enumerate(pictures)]
    return np.stack(moved, 2)


def _residuals(coefs: Array, uv: Array, xyz: Array) -> Array:
    """How far points (n, m, 3) project from uv (n, m, c, 2): rms with 2 k - 3 degrees of freedom, k cameras; (n, m)."""
    P = np.concatenate([coefs, np.ones((1, coefs.shape[1]))]).T.reshape(-1, 3, 4)
    h = np.einsum("cij,nmj->nmci", P, np.concatenate([xyz, np.ones((*xyz.shape[:2], 1))], -1))
    with np.errstate(invalid="ignore", divide="ignore"):
        off = h[..., :2] / h[..., 2:] - uv
    seen = np.isfinite(off).all(-1)
    spare = 2 * seen.sum(-1) - 3
    square = np.where(seen, (np.nan_to_num(off) ** 2).sum(-1), 0.0).sum(-1)
    return np.where(spare > 0, np.sqrt(square / np.maximum(spare, 1)), np.nan)


def _csv(header: list[str], values: Array) -> bytes:
    lines = [",".join(header)] if header else []
    lines += [",".join("NaN" if v != v else repr(v) for v in row) for row in values.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _profile(cameras: tuple[Camera, ...]) -> tuple[str, list[str]]:
    """Argus's lines, and what each fit leaves.

    The pose is in the coefficients, so that the lens only moves positions without distortion to where they lie in the
    picture: its terms are fitted to that, over the picture, with the focal length of the columns for both directions,
    as Argus has it.
    """
    lines, notes = [], []
    for number, camera in enumerate(cameras, 1):
        if camera.projection != "perspective":
            raise VidtrackError(f"camera {camera.name}: its lens is equidistant, and the format has no such lens.")
        width, height = camera.image_size
        X, Y = np.meshgrid(np.linspace(-0.5, width - 0.5, GRID), np.linspace(-0.5, height - 0.5, GRID))
        b = np.stack([X.ravel(), Y.ravel()], -1)
        f = camera.f * camera.Sx / camera.dx
        x, d = ((each - [camera.Cx, camera.Cy]) / f for each in (without_lens(camera, b), b))
        seen = np.isfinite(x).all(-1)
        A = _distortion(x[seen])
        terms, *_ = np.linalg.lstsq(A.reshape(-1, 5), (d - x)[seen].ravel(), rcond=None)
        k1, k2, t1, t2, k3 = terms.tolist()
        worst = f * float(np.linalg.norm(A @ terms - (d - x)[seen], axis=-1).max())
        own = [f, width, height, camera.Cx, camera.Cy, 1.0, k1, k2, t1, t2, k3]
        lines.append(" ".join(map(repr, [number, *own])))
        notes.append(f"{camera.name}: the profile's lens is within {worst:.3g} px over the picture")
    return "\n".join(lines) + "\n", notes


def _distortion(x: Array) -> Array:
    """What k1, k2, t1, t2, k3 move tangents x (n, 2) by, (n, 2, 5): OpenCV's terms."""
    X, Y = x[:, 0], x[:, 1]
    r2 = X * X + Y * Y
    t1, t2 = np.stack([2 * X * Y, r2 + 2 * Y * Y], -1), np.stack([r2 + 2 * X * X, 2 * X * Y], -1)
    return np.stack([x * r2[:, None], x * r2[:, None] ** 2, t1, t2, x * r2[:, None] ** 3], -1)

"""OpenPTV's .ori and .addpar: two files a camera.

Source: liboptv (calibration.c, imgcoord.c, trafo.c).

origin          px: the corner of the top-left pixel is (0, 0); metric coordinates from the middle of the picture, y up
axes            camera: x right, y up, looking along -z; omega, phi, kappa (rad) and the matrix below them turn camera
                axes into world axes
units           mm; the pitch of pixels, which parameters/ptv.par needs, stands in <camera>.json
lens            k1 k2 k3 p1 p2 scx she, from undistorted to distorted and about the middle of the picture, not the
                principal point: cc, xh, yh, k1 to k3, p1, p2 are fitted over the picture; largest_error_px in
                <camera>.json has what the fit leaves
interfaces      none: the glass vector is that of OpenPTV's own examples, which in air means nothing
"""

from __future__ import annotations

import json

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.colmap import HALF
from vidtrack.exchange.ideal_to_distorted import GRID, straight
from vidtrack.exchange.measured import Run, Written
from vidtrack.geometry.camera import Camera, undistorted_from_frame_buffer

FLIP = np.diag([1.0, -1.0, -1.0])
"""From our camera axes to OpenPTV's: y up, z backwards."""
GLASS = (0.0001, 0.0001, 0.0001)
LINEAR = 8
"""Gauss-Newton steps of the fit, which is nearly linear."""


def write(run: Run) -> Written:
    """The calibrated cameras, <camera>.tif.ori, <camera>.tif.addpar and <camera>.json each."""
    files: dict[str, bytes] = {}
    notes = []
    mm = run.in_unit("mm")
    for name, camera in sorted(run.cameras.items()):
        inner, pitch, worst = fitted(camera)
        cc, xh, yh, *added = inner.tolist()
        dm = camera.R.T @ FLIP
        rows = [" ".join(repr(float(v)) for v in row) for row in dm]
        place = " ".join(repr(float(v)) for v in camera.position * mm)
        turn = " ".join(repr(float(v)) for v in angles(dm))
        lines = [place, turn, "", *rows, "", f"{xh!r} {yh!r}", repr(cc), "", " ".join(map(repr, GLASS))]
        files[f"{name}.tif.ori"] = ("\n".join(lines) + "\n").encode()
        files[f"{name}.tif.addpar"] = (" ".join(map(repr, [*added, 1.0, 0.0])) + "\n").encode()
        record = {"imx": camera.image_size[0], "imy": camera.image_size[1], "pix_x": pitch[0], "pix_y": pitch[1]}
        files[f"{name}.json"] = (json.dumps(record | {"largest_error_px": worst}, indent=1) + "\n").encode()
        notes.append(f"{name}: the fitted lens is within {worst:.3g} px over the picture")
    if not files:
        raise VidtrackError("no calibrated camera. Call vidtrack run first.")
    return Written(files, notes)


def angles(dm: Array) -> Array:
    """omega, phi, kappa (3,), rad, of the matrix (3, 3) = Rx(omega) Ry(phi) Rz(kappa)."""
    omega = np.arctan2(-dm[1, 2], dm[2, 2])
    return np.array([omega, np.arctan2(dm[0, 2], np.hypot(dm[0, 0], dm[0, 1])), np.arctan2(-dm[0, 1], dm[0, 0])])


def fitted(camera: Camera) -> tuple[Array, tuple[float, float], float]:
    """cc, xh, yh, k1, k2, k3, p1, p2 (mm), the pitch of columns and rows (mm), and the largest error left, px.

    VidtrackError for a wide lens, one that looks through interfaces, or skew.
    """
    if straight(camera).projection == "equidistant" or camera.skew:
        raise VidtrackError(f"camera {camera.name}: OpenPTV has neither equidistant lenses nor skew.")
    width, height = camera.image_size
    pitch = camera.dx / camera.Sx, camera.dy
    X, Y = np.meshgrid(np.linspace(-0.5, width - 0.5, GRID), np.linspace(-0.5, height - 0.5, GRID))
    b = np.stack([X.ravel(), Y.ravel()], -1)
    flat = undistorted_from_frame_buffer(camera, b) / camera.f * [1, -1]
    seen = np.isfinite(flat).all(-1)
    flat, b = flat[seen], b[seen]
    metric = (b + HALF - [width / 2, height / 2]) * pitch * [1, -1]
    size = float(np.abs(metric).max())
    middle = [camera.Cx + HALF - width / 2, height / 2 - camera.Cy - HALF]
    parameters = np.array([camera.f, middle[0] * pitch[0], middle[1] * pitch[1], 0, 0, 0, 0, 0])
    step = np.array([size, size, size, size**-2, size**-4, size**-6, 1 / size, 1 / size])
    for _ in range(LINEAR):
        left = (metric - _distorted(parameters, flat)).ravel()
        J = np.stack(
            [
                (_distorted(parameters + 1e-6 * e, flat) - _distorted(parameters - 1e-6 * e, flat)).ravel() / 2e-6
                for e in np.diag(step)
            ],
            -1,
        )
        parameters = parameters + step * np.linalg.lstsq(J, left, rcond=None)[0]
    off = (metric - _distorted(parameters, flat)) / pitch
    return parameters, (float(pitch[0]), float(pitch[1])), float(np.linalg.norm(off, axis=-1).max())


def _distorted(parameters: Array, flat: Array) -> Array:
    """Metric positions (n, 2), mm, y up, of X/Z and -Y/Z (n, 2), as liboptv's flat_to_dist."""
    cc, xh, yh, k1, k2, k3, p1, p2 = parameters
    x, y = cc * flat[:, 0] + xh, cc * flat[:, 1] + yh
    r2 = x * x + y * y
    gain = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return np.stack(
        [
            x * gain + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y,
            y * gain + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y,
        ],
        -1,
    )

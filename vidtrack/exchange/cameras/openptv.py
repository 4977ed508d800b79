"""OpenPTV: cam1.ori (pose) with cam1.addpar beside it (lens).

    .ori     x0 y0 z0 / omega phi kappa (rad) / 3 x 3 rotation / xh yh / cc / glass vector
    .addpar  k1 k2 k3 p1 p2 scx she

mm, right-handed. The camera looks along -z, metric y up, the origin of the sensor in the middle of the picture, w/2,
h/2, where the centre of the first pixel is (0.5, 0.5). The lens goes from undistorted to distorted and acts about
the sensor's middle, not the principal point (xh, yh); then scx and she stretch and shear. Neither the picture's size
nor the pixels' are in these files: `camera_file.size` and `cameras.<camera>.sensor` give them. Refraction is not in
them either: OpenPTV applies it by multimed.par, so a glass vector is reported. Source: liboptv calibration.c,
imgcoord.c, trafo.c.
"""

from __future__ import annotations

import os
import re

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.fitting import fitted
from vidtrack.exchange.cameras.given import Given, Said, lens_findings, needed_size, rotation
from vidtrack.exchange.text import Path, lines_of, numbers
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera


def read(path: Path, said: Said) -> Given:
    """The camera in an .ori and its .addpar."""
    rows = [row for line in lines_of(path) if (row := numbers(line.split()))]
    flat = [value for row in rows for value in row]
    if len(flat) < 18 or not np.isfinite(flat[:18]).all():
        raise VidtrackError(f"{path}: {len(flat)} numbers; an .ori file has 18 or 21. Copy the whole file again.")
    x0, dm, (xh, yh, cc) = np.array(flat[:3]), rotation(flat[6:15], path), flat[15:18]
    glass = np.array(flat[18:21]) if len(flat) >= 21 else np.zeros(3)
    lens = _addpar(path)
    width, height = needed_size(said, "OpenPTV")
    if said.sensor is None:
        raise VidtrackError(
            f"config.yaml: cameras.{said.name}.sensor: an OpenPTV file has no size of the pixels. Give sensor: "
            "[width, height] "
            "of the picture on the sensor in mm (columns and rows times imx and imy of ptv.par)."
        )
    dx, dy = said.sensor[0] / width, said.sensor[1] / height
    if not cc > 0:
        raise VidtrackError(f"{path}: the principal distance {cc:g} is not positive. Correct the value.")
    R = np.diag([1.0, -1.0, -1.0]) @ dm.T
    start = Camera(
        *(width / 2 - 0.5 + xh / dx, height / 2 - 0.5 - yh / dy, dx, dy, 1.0, cc, 0.0),
        R=R,
        T=-R @ x0,
        image_size=(width, height),
        name=said.name,
    )
    middle = np.array([width / 2 - 0.5, height / 2 - 0.5])

    def seen(x: Array) -> Array:
        metric = _distorted(np.stack([cc * x[:, 0] + xh, -cc * x[:, 1] + yh], -1), lens)
        return np.asarray(middle + metric * [1 / dx, -1 / dy])

    camera, largest = fitted(start, seen)
    findings = lens_findings("OpenPTV", said.name, largest)
    if np.linalg.norm(glass) > 1e-3:
        text = f"{said.name}: the OpenPTV file has a plane of glass, and refraction is not applied"
        findings += (Finding("doubtful", "glass-not-applied", text, "Nothing where multimed.par has one medium only."),)
    return Given("openptv", camera, largest, "mm", findings)


def _distorted(x: Array, lens: Array) -> Array:
    """Metric image coordinates (n, 2), mm, with k1 k2 k3 p1 p2 scx she."""
    k1, k2, k3, p1, p2, scx, she = lens
    X, Y = x[:, 0], x[:, 1]
    r2 = X * X + Y * Y
    radial = k1 * r2 + k2 * r2**2 + k3 * r2**3
    Xd = X * (1 + radial) + p1 * (r2 + 2 * X * X) + 2 * p2 * X * Y
    Yd = Y * (1 + radial) + p2 * (r2 + 2 * Y * Y) + 2 * p1 * X * Y
    return np.stack([scx * Xd - np.sin(she) * Yd, np.cos(she) * Yd], -1)


def _addpar(path: Path) -> Array:
    stem = re.sub(r"\.ori$", "", os.fspath(path))
    beside = f"{stem}.addpar"
    if not os.path.isfile(beside):
        raise VidtrackError(f"{beside}: no such file. The lens of {path} is in it; put it there.")
    flat = [value for line in lines_of(beside) if (row := numbers(line.split())) for value in row]
    if len(flat) < 7 or not np.isfinite(flat[:7]).all():
        raise VidtrackError(f"{beside}: {len(flat)} numbers; an .addpar file has 7. Copy the whole file again.")
    return np.array(flat[:7])

"""OpenCV's YAML: one file a camera, read by cv.FileStorage.

    camera_matrix, distortion_coefficients (k1 k2 p1 p2 k3; of a wide lens k1 k2 k3 k4 and fisheye_model 1),
    image_width, image_height, R, T, position, largest_error_px

origin          px: the centre of the top-left pixel is (0, 0), Y down, as in vidtrack
axes            camera: x right, y down, z forward; c = R p + T for p in the world's axes
units           T in the experiment's unit, which `units` names; camera_matrix in px
lens            from undistorted to distorted, the other way than Tsai's: refitted over the picture, and the largest
                distance that the refit leaves is largest_error_px
"""

from __future__ import annotations

import json

import numpy as np

from vidtrack.arrays import Array
from vidtrack.exchange.ideal_to_distorted import Refitted, notes_of, refitted
from vidtrack.exchange.measured import Run, Written


def write(run: Run) -> Written:
    """The calibrated cameras, a file each."""
    cameras = refitted(run)
    return Written({f"{own.name}.yml": _text(own, run.units).encode() for own in cameras}, notes_of(cameras))


def coefficients(own: Refitted) -> list[float]:
    """Distortion in OpenCV's order: k1 k2 p1 p2 k3, of a wide lens k1 k2 k3 k4."""
    k = own.lens.k
    return [*k] if own.lens.fisheye else [k[0], k[1], own.lens.p1, own.lens.p2, k[2]]


def matrix(own: Refitted) -> Array:
    """The camera matrix (3, 3), px."""
    lens = own.lens
    return np.array([[lens.fx, 0, lens.cx], [0, lens.fy, lens.cy], [0, 0, 1.0]])


def _text(own: Refitted, units: str) -> str:
    width, height = own.camera.image_size
    lines = ["%YAML:1.0", "---", f"camera_name: {json.dumps(own.name)}", f"units: {json.dumps(units)}"]
    lines += [f"image_width: {width}", f"image_height: {height}", f"fisheye_model: {int(own.lens.fisheye)}"]
    lines += [*_matrix("camera_matrix", matrix(own)), *_matrix("distortion_coefficients", [coefficients(own)])]
    lines += [*_matrix("R", own.camera.R), *_matrix("T", own.camera.T[:, None])]
    lines += [*_matrix("position", own.camera.position[:, None]), f"largest_error_px: {_number(own.largest_px)}"]
    return "\n".join(lines) + "\n"


def _matrix(name: str, values: object) -> list[str]:
    a = np.atleast_2d(np.asarray(values, float))
    data = ", ".join(_number(v) for v in a.ravel().tolist())
    return [
        f"{name}: !!opencv-matrix",
        f"   rows: {a.shape[0]}",
        f"   cols: {a.shape[1]}",
        "   dt: d",
        f"   data: [ {data} ]",
    ]


def _number(value: float) -> str:
    """A number with a point, by which OpenCV takes it for a real number."""
    text = repr(float(value))
    return text if "." in text or "inf" in text or "nan" in text else text.replace("e", ".0e")

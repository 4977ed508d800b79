"""anipose's calibration.toml: all cameras in one file.

origin          px: the centre of the top-left pixel is (0, 0), Y down, as in vidtrack
axes            camera: x right, y down, z forward; rotation (Rodrigues' vector) and translation take world to camera
units           translation in the experiment's unit, which [metadata] names; matrix in px
lens            OpenCV's, from undistorted to distorted: refitted over the picture; [metadata] largest_error_px has what
                the refit leaves. Five distortions, of a wide lens four and `fisheye = true`
order           aniposelib sorts the tables by their names as text: they are numbered with as many digits as it takes
"""

from __future__ import annotations

import json

from vidtrack.exchange.ideal_to_distorted import notes_of, refitted
from vidtrack.exchange.measured import Run, Written
from vidtrack.exchange.opencv_yaml import coefficients, matrix


def write(run: Run) -> Written:
    """The calibrated cameras as one file."""
    from scipy.spatial.transform import Rotation

    cameras = refitted(run)
    digits = len(str(len(cameras) - 1))
    lines = []
    for i, own in enumerate(cameras):
        lines += [f"[cam_{i:0{digits}}]", f"name = {_text(own.name)}", f"size = {list(own.camera.image_size)}"]
        lines += [f"matrix = {matrix(own).tolist()}", f"distortions = {[float(v) for v in coefficients(own)]}"]
        lines += [f"rotation = {Rotation.from_matrix(own.camera.R).as_rotvec().tolist()}"]
        lines += [f"translation = {own.camera.T.tolist()}"]
        lines += [*(["fisheye = true"] if own.lens.fisheye else []), ""]
    worst = ", ".join(f"{_text(own.name)} = {own.largest_px!r}" for own in cameras)
    lines += ["[metadata]", f"units = {_text(run.units)}", f"software = {_text(f'vidtrack {run.version}'.strip())}"]
    lines += [f"largest_error_px = {{ {worst} }}"]
    return Written({"calibration.toml": ("\n".join(lines) + "\n").encode()}, notes_of(cameras))


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)

"""COLMAP's text files: cameras.txt, images.txt and an empty points3D.txt.

origin          px: the corner of the top-left pixel is (0, 0), so its centre is (0.5, 0.5): half a pixel is added
axes            camera: x right, y down, z forward; quaternion w, x, y, z and translation take world to camera
units           translation in the experiment's unit; params in px
lens            FULL_OPENCV (fx fy cx cy k1 k2 p1 p2 k3 0 0 0) or, of a wide lens, OPENCV_FISHEYE, from undistorted to
                distorted: refitted over the picture; a comment has what the refit leaves
"""

from __future__ import annotations

from vidtrack.exchange.ideal_to_distorted import Refitted, notes_of, refitted
from vidtrack.exchange.measured import Run, Written

HALF = 0.5
"""px, from the centre of the top-left pixel to its corner."""


def write(run: Run) -> Written:
    """The calibrated cameras: each is one camera and one image, named as the camera."""
    from scipy.spatial.transform import Rotation

    cameras = refitted(run)
    seen = [f"# {note}" for note in notes_of(cameras)]
    lenses = [*seen, "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"]
    images = [f"# units: {run.units}", "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"]
    for i, own in enumerate(cameras, 1):
        width, height = own.camera.image_size
        lenses.append(" ".join([str(i), _model(own), str(width), str(height), *map(repr, _parameters(own))]))
        x, y, z, w = Rotation.from_matrix(own.camera.R).as_quat(canonical=True).tolist()
        pose = [w, x, y, z, *own.camera.T.tolist()]
        images += [" ".join([str(i), *map(repr, pose), str(i), own.name]), ""]
    texts = {"cameras.txt": lenses, "images.txt": images, "points3D.txt": ["# no points"]}
    return Written({name: ("\n".join(lines) + "\n").encode() for name, lines in texts.items()}, notes_of(cameras))


def _model(own: Refitted) -> str:
    return "OPENCV_FISHEYE" if own.lens.fisheye else "FULL_OPENCV"


def _parameters(own: Refitted) -> list[float]:
    lens = own.lens
    middle = [lens.fx, lens.fy, lens.cx + HALF, lens.cy + HALF]
    if lens.fisheye:
        return [*middle, *lens.k]
    return [*middle, lens.k[0], lens.k[1], lens.p1, lens.p2, lens.k[2], 0.0, 0.0, 0.0]

"""COLMAP's text files, projected by the equations of its own documentation."""

import numpy as np
from scipy.spatial.transform import Rotation

from tests.exchange.runs import camera, run
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.exchange.colmap import write


def rows(content):
    return [line.split() for line in content.decode().splitlines() if line and not line.startswith("#")]


def full_opencv(parameters, x, y):
    fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 = parameters
    r2 = x * x + y * y
    gain = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    u = x * gain + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * gain + 2 * p2 * x * y + p1 * (r2 + 2 * y * y)
    return np.stack([fx * u + cx, fy * v + cy], -1)


def test_a_camera_sees_what_ours_sees_half_a_pixel_on():
    own = camera(kappa1=8e-4)
    written = write(run(cameras={"cam1": own}))
    (lens,), (image,) = rows(written.files["cameras.txt"]), rows(written.files["images.txt"])
    assert lens[:4] == ["1", "FULL_OPENCV", "512", "480"]
    assert image[8:] == ["1", "cam1"]
    p, b = seen_by(own)
    w, x, y, z, *T = map(float, image[1:8])
    c = p @ Rotation.from_quat([x, y, z, w]).as_matrix().T + T
    px = full_opencv([float(v) for v in lens[4:]], c[:, 0] / c[:, 2], c[:, 1] / c[:, 2])
    assert np.linalg.norm(px - (b + 0.5), axis=-1).max() < 0.02


def test_a_wide_lens_has_the_model_of_wide_lenses():
    lens = rows(write(run(cameras={"c": camera(projection="equidistant", kappa1=1e-4)})).files["cameras.txt"])[0]
    assert lens[1] == "OPENCV_FISHEYE"
    assert len(lens) == 4 + 8

"""Metashape's XML, projected by the equations of its manual."""

from xml.etree import ElementTree

import numpy as np
import pytest

from tests.exchange.runs import camera, run
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.exchange.metashape import write


@pytest.mark.parametrize("own", [camera(kappa1=8e-4), camera(kappa1=-4e-4, p1=2e-5, p2=-1e-5, skew=3e-4)])
def test_a_camera_sees_what_ours_sees(own):
    root = ElementTree.fromstring(write(run(cameras={"cam1": own})).files["cameras.xml"])
    calibration = root.find("chunk/sensors/sensor/calibration")
    v = {child.tag: float(child.text) for child in calibration if child.text}
    size = calibration.find("resolution").attrib
    place = np.array(root.find("chunk/cameras/camera/transform").text.split(), float).reshape(4, 4)
    p, b = seen_by(own)
    c = (p - place[:3, 3]) @ place[:3, :3]
    x, y = c[:, 0] / c[:, 2], c[:, 1] / c[:, 2]
    r2 = x * x + y * y
    gain = 1 + v["k1"] * r2 + v["k2"] * r2**2 + v["k3"] * r2**3
    X = x * gain + v["p1"] * (r2 + 2 * x * x) + 2 * v["p2"] * x * y
    Y = y * gain + v["p2"] * (r2 + 2 * y * y) + 2 * v["p1"] * x * y
    u = float(size["width"]) / 2 + v["cx"] + X * v["f"] + X * v["b1"] + Y * v["b2"]
    w = float(size["height"]) / 2 + v["cy"] + Y * v["f"]
    off = np.linalg.norm(np.stack([u, w], -1) - (b + 0.5), axis=-1).max()
    assert off <= 1.05 * float(calibration.attrib["largest_error_px"]) + 1e-6
    assert off < 0.05


def test_the_camera_has_its_name_and_the_unit_is_stated():
    root = ElementTree.fromstring(write(run("cm", cameras={"é1": camera("é1")})).files["cameras.xml"])
    assert root.find("chunk/cameras/camera").attrib["label"] == "é1"
    assert root.find("chunk").attrib["units"] == "cm"

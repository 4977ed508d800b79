"""OpenPTV's files, projected by the equations of liboptv (imgcoord.c, trafo.c, calibration.c)."""

import json

import numpy as np
import pytest

from tests.exchange.runs import camera, run
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.errors import VidtrackError
from vidtrack.exchange.openptv import write


def liboptv(files, name, p):
    """Pixels of world points (n, 3), mm."""
    ori = [float(v) for v in files[f"{name}.tif.ori"].split()]
    k1, k2, k3, p1, p2, scx, she = (float(v) for v in files[f"{name}.tif.addpar"].split())
    record = json.loads(files[f"{name}.json"])
    place, (omega, phi, kappa), dm = np.array(ori[:3]), ori[3:6], np.array(ori[6:15]).reshape(3, 3)
    xh, yh, cc = ori[15:18]
    cp, sp, co, so, ck, sk = (f(a) for a in (phi, omega, kappa) for f in (np.cos, np.sin))
    turned = [
        [cp * ck, -cp * sk, sp],
        [co * sk + so * sp * ck, co * ck - so * sp * sk, -so * cp],
        [so * sk - co * sp * ck, so * ck + co * sp * sk, co * cp],
    ]
    np.testing.assert_allclose(turned, dm, atol=1e-12)
    c = (p - place) @ dm
    assert (c[:, 2] < 0).all()
    x, y = -cc * c[:, 0] / c[:, 2] + xh, -cc * c[:, 1] / c[:, 2] + yh
    r2 = x * x + y * y
    gain = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    X = x * gain + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y
    Y = y * gain + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y
    X, Y = scx * (X - np.sin(she) * Y), scx * np.cos(she) * Y
    u, v = X / record["pix_x"] + record["imx"] / 2, record["imy"] / 2 - Y / record["pix_y"]
    return np.stack([u, v], -1), record["largest_error_px"]


@pytest.mark.parametrize("own", [camera(kappa1=8e-4), camera(kappa1=-6e-4, p1=2e-5), camera(kappa1=0.0)])
def test_liboptv_sees_what_ours_sees_half_a_pixel_on(own):
    p, b = seen_by(own)
    px, stated = liboptv(write(run("in", cameras={"cam1": own})).files, "cam1", p * 25.4)
    off = np.linalg.norm(px - (b + 0.5), axis=-1).max()
    assert off <= 1.05 * stated + 1e-6
    assert off < 0.05


def test_a_camera_without_a_sensor_keeps_its_pixels():
    own = camera(dx=1.0, dy=1.0, f=800.0, kappa1=1e-8)
    p, b = seen_by(own)
    px, _ = liboptv(write(run("m", cameras={"cam1": own})).files, "cam1", p * 1000)
    assert np.linalg.norm(px - (b + 0.5), axis=-1).max() < 0.05


@pytest.mark.parametrize("own", [camera(projection="equidistant"), camera(skew=1e-4)])
def test_lenses_that_openptv_does_not_have_are_refused(own):
    with pytest.raises(VidtrackError, match="neither equidistant lenses nor skew"):
        write(run(cameras={"cam1": own}))

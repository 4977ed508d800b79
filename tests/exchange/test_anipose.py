"""anipose's TOML, read by tomllib and projected by OpenCV as aniposelib does."""

import tomllib

import cv2
import numpy as np

from tests.exchange.runs import camera, run
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.exchange.anipose import write


def read(**cameras):
    return tomllib.loads(write(run(cameras=cameras)).files["calibration.toml"].decode())


def test_cameras_see_what_ours_see():
    own = {"cam1": camera("cam1"), "é": camera("é", pan=-40.0, kappa1=-5e-4)}
    toml = read(**own)
    for key, name in (("cam_0", "cam1"), ("cam_1", "é")):
        got = toml[key]
        assert got["name"] == name
        assert got["size"] == [512, 480]
        p, b = seen_by(own[name])
        K, k = np.array(got["matrix"]), np.array(got["distortions"])
        px = cv2.projectPoints(p, np.array(got["rotation"]), np.array(got["translation"]), K, k)[0][:, 0]
        assert np.linalg.norm(px - b, axis=-1).max() <= 1.05 * toml["metadata"]["largest_error_px"][name] + 1e-6
    assert toml["metadata"]["units"] == "in"


def test_the_order_of_many_cameras_survives_sorting_by_text():
    names = [f"c{i:02}" for i in range(12)]
    toml = read(**{name: camera(name) for name in names})
    assert [toml[key]["name"] for key in sorted(toml) if key != "metadata"] == names


def test_a_wide_lens_says_so():
    got = read(cam1=camera(projection="equidistant", kappa1=1e-4))["cam_0"]
    assert got["fisheye"] is True
    assert len(got["distortions"]) == 4

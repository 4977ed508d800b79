"""The calibration as the run's pictures have it."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.geometry.picture_part import Picture, Window
from vidtrack.location.cameras.run_pictures import (
    Pictures,
    camera_shown,
    columns_in_calibration,
    columns_shown,
    windows,
)
from vidtrack.simulate.rig import thesis_rig

HALF = Window(0, 0, 512, 480, 256, 240)


def table():
    return pd.DataFrame({"tag": ["a", "b"], "Xf": [0.0, 511.0], "Yf": [0.0, np.nan], "sd_x": 0.1, "sd_y": 0.2})


def test_only_cameras_whose_pictures_differ_have_a_window():
    same, half = Picture(512, 480), Picture(256, 240)
    shown, findings = windows({"cam1": Pictures(same, same), "cam2": Pictures(same, half)}, "runs.r1")
    assert shown == {"cam2": HALF}
    assert len(findings) == 1


def test_points_and_their_noise_shrink_with_the_picture_and_missing_ones_stay_missing():
    small = columns_shown(table(), HALF)
    assert list(small["Xf"]) == [-0.25, 255.25]
    assert np.isnan(small["Yf"][1])
    assert list(small["sd_x"]) == [0.05, 0.05]


def test_centroids_go_the_other_way():
    back = columns_in_calibration(columns_shown(table(), HALF), HALF)
    pd.testing.assert_frame_equal(pd.DataFrame(back), table()[list(back)])


def test_a_camera_of_unknown_uncertainty_stays_unknown():
    camera, uncertainty = camera_shown(thesis_rig(2)[0], None, HALF)
    assert camera.image_size == (256, 240)
    assert uncertainty is None


def test_without_a_window_nothing_changes():
    camera, points = thesis_rig(2)[0], table()
    assert camera_shown(camera, None, None) == (camera, None)
    assert columns_shown(points, None) == {}
    assert columns_in_calibration(points, None) == {}


@pytest.mark.parametrize("crop", [(0, 0, 512, 480), (128, 120, 256, 240)])
def test_a_crop_of_the_config_is_used(crop):
    shown, findings = windows({"c": Pictures(Picture(512, 480), Picture(256, 240), crop)}, "runs.r1")
    assert shown["c"][:4] == crop
    assert findings == []

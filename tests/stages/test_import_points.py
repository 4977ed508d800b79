import numpy as np
import pandas as pd
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.stages.import_points import Seen, drawn, import_points

SURVEY = pd.DataFrame({"tag": ["1", "2", "3"], "x": [0.0, 10, 20], "y": [0.0, 1, 2], "z": [5.0, 6, 7]})
NOTHING = np.full(2, np.nan)


def seen(**more):
    own = {"tags": ("3", "1"), "b": np.array([[30.0, 40], [10, 20]]), "sd": NOTHING, "pixels": NOTHING}
    return Seen(**(own | {"p": np.full((2, 3), np.nan)} | more))


def test_points_get_their_place_from_the_survey_and_those_not_digitised_a_reason():
    table, findings = import_points(
        {"row1": seen()}, SURVEY, tags={"row1": ["1", "2", "3"]}, sd={"row1": 0.2}, sigma=0.05
    )
    assert table["tag"].tolist() == ["1", "2", "3"]
    assert table["found"].tolist() == [True, False, True]
    assert table["reason"].tolist() == ["", "not digitised", ""]
    assert table.loc[2, ["x", "y", "z", "Xf", "Yf", "sd_x", "sigma"]].tolist() == [20, 2, 7, 30, 40, 0.2, 0.05]
    assert np.isnan(table.loc[1, "Xf"])
    assert findings == []


def test_the_sd_of_the_file_counts_before_that_of_the_config_and_none_is_nan():
    own = seen(sd=np.array([0.1, np.nan]))
    table, _ = import_points({"row1": own}, SURVEY, tags={"row1": ["1", "3"]}, sd={"row1": 0.2})
    assert table["sd_x"].tolist() == [0.2, 0.1]
    table, _ = import_points({"row1": own}, SURVEY, tags={"row1": ["1", "3"]}, sd={"row1": None})
    assert np.isnan(table["sd_x"][0])


def test_a_place_that_differs_from_the_survey_is_reported():
    own = seen(p=np.array([[20, 2, 7.5], [0, 0, 5.004]]))
    _, findings = import_points({"row1": own}, SURVEY, tags={"row1": ["1", "3"]}, sd={"row1": None}, camera="cam1")
    assert [finding.code for finding in findings] == ["survey-differs"]
    assert "3 by 0.5" in findings[0].text


def test_a_tag_that_was_not_surveyed_is_refused():
    with pytest.raises(VidtrackError, match=r"calibration/row1/cam1: tag 9 is not in points\.csv"):
        import_points({"row1": seen(tags=("9", "1"))}, SURVEY, tags={"row1": []}, sd={"row1": None}, camera="cam1")


def test_the_drawn_picture_shows_each_point_where_it_is():
    table, _ = import_points({"row1": seen()}, SURVEY, tags={"row1": []}, sd={"row1": None})
    picture = drawn(table, (64, 48))
    assert picture.shape == (48, 64)
    bright = picture > 100
    assert bright[40, 30]
    assert bright[20, 10]
    assert not bright[:15].any()

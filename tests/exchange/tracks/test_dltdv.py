import io

import numpy as np
import pandas as pd
import pytest

from tests.exchange.tracks.made import SIZE, dltdv, positions
from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks

WHERE = "runs.a.tracks"


def read(tmp_path, text, **said):
    path = tmp_path / "cam2.csv"
    path.write_text(text)
    how = Convention(**({"camera": "2"} | said))
    tracks = read_tracks(path, how, WHERE)
    return tracks, placed(tracks, how, WHERE)


def test_dltdv_8_counts_from_the_upper_left_corner_from_one(tmp_path):
    b = positions()
    tracks, found = read(tmp_path, dltdv(b, letters="UV"))
    np.testing.assert_allclose(found, b, atol=6e-7)
    assert tracks.names == ("pt1", "pt2")
    assert tracks.named
    assert tracks.together


def test_dltdv_5_to_7_count_from_the_lower_left_corner_and_the_config_says_so(tmp_path):
    b = positions()
    text = dltdv(b, origin="lower-left")
    found = read(tmp_path, text, origin="lower-left", size=SIZE)[1]
    np.testing.assert_allclose(found, b, atol=6e-7)
    with pytest.raises(VidtrackError, match=r"runs\.a\.tracks\.origin"):
        read(tmp_path, text)
    with pytest.raises(VidtrackError, match=r"runs\.a\.tracks\.size"):
        read(tmp_path, text, origin="lower-left")


def test_argus_has_columns_from_zero_rows_from_below_and_zeros_for_what_is_missing(tmp_path):
    b = positions()
    text = dltdv(b, letters="xy", origin="lower-left", camera="_cam_2", other="_cam_1", first=(0, 1))
    found = read(tmp_path, text.replace("NaN,NaN", "0.000000,0.000000"), size=SIZE)
    assert found[0].format == "argus"
    np.testing.assert_allclose(found[1], b, atol=6e-7)


def test_the_values_are_those_that_pandas_reads(tmp_path):
    text = dltdv(positions(), letters="UV", names=["nose é", "tail"])
    tracks, _ = read(tmp_path, text)
    theirs = pd.read_csv(io.StringIO(text))
    np.testing.assert_array_equal(tracks.b[:, 1], theirs[["tail_cam2_U", "tail_cam2_V"]].to_numpy())


def test_which_camera_is_meant_is_asked_for_where_there_are_several(tmp_path):
    with pytest.raises(VidtrackError, match=r"tracks\.camera.*cam1, cam2"):
        read(tmp_path, dltdv(positions()), camera=None)
    assert read(tmp_path, dltdv(positions()), camera="cam2", origin="upper-left")[1].shape == (40, 2, 2)


@pytest.mark.parametrize("change", ["crlf", "semicolons", "blanks", "no last line end"])
def test_spreadsheets_may_have_saved_the_table_again(tmp_path, change):
    b = positions()
    text = dltdv(b, letters="UV")
    if change == "crlf":
        text = text.replace("\n", "\r\n")
    elif change == "semicolons":
        text = text.replace(",", ";").replace(".", ",")
    elif change == "blanks":
        text = text.replace("NaN", "")
    else:
        text = text.rstrip("\n")
    np.testing.assert_allclose(read(tmp_path, text)[1], b, atol=6e-7)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (dltdv(positions(), letters="UV")[:-40], "Copy the whole file again"),
        (
            dltdv(positions(), letters="UV").replace("pt2_cam2_V", "pt2_cam2_W"),
            "one of its two columns|no number|cells",
        ),
        (dltdv(positions(), letters="UV").replace("101.", "1o1."), "is no number"),
        (dltdv(positions(), letters="UV").split("\n")[0] + "\n", "no rows"),
    ],
)
def test_a_table_that_is_not_whole_is_refused_in_one_line(tmp_path, text, what):
    with pytest.raises(VidtrackError, match=what) as error:
        read(tmp_path, text)
    assert "\n" not in str(error.value)

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, Digitised, of_rows, placed


def tracks(b, **more):
    return Digitised("x", ("a",), np.arange(len(b)), np.asarray(b, float)[:, None], True, **more)


@given(st.integers(2, 4000), st.integers(2, 4000), st.sampled_from([0.0, 0.5, 1.0]))
def test_the_corners_of_the_picture_are_the_corners_whatever_the_convention(width, height, first):
    size = (width, height)
    upper = tracks([[first, first], [width - 1 + first, height - 1 + first]], origin="upper-left", first=(first, first))
    lower = tracks([[first, height - 1 + first], [width - 1 + first, first]], origin="lower-left", first=(first, first))
    corners = [[0, 0], [width - 1, height - 1]]
    for own in (upper, lower):
        assert placed(own, Convention(size=size), "here")[:, 0].tolist() == corners


def test_what_the_config_says_counts_before_what_the_format_says():
    own = tracks([[10, 20]], origin="upper-left", first=(0.0, 0.0))
    assert placed(own, Convention(first=(0.5, 0.5)), "here")[0, 0].tolist() == [9.5, 19.5]


@pytest.mark.parametrize(
    ("more", "key"),
    [({"first": (0.0, 0.0)}, "origin"), ({"origin": "upper-left"}, "first_pixel")],
)
def test_what_no_file_says_is_asked_for_by_its_key(more, key):
    with pytest.raises(VidtrackError, match=rf"config.yaml: runs\.a\.tracks\.{key}: ") as error:
        placed(tracks([[1, 2]], **more), Convention(), "runs.a.tracks")
    assert "\n" not in str(error.value)


def test_tracks_outside_of_the_picture_are_refused():
    own = tracks([[700, 20]] * 10, origin="upper-left", first=(0.0, 0.0))
    with pytest.raises(VidtrackError, match="10 of 10 samples lie outside"):
        placed(own, Convention(size=(640, 480)), "here")


def test_rows_become_tracks_in_the_order_of_their_names_in_the_file():
    names, frame, b, twice = of_rows("a.csv", [3, 1, 3], ["b", "a", "a"], np.array([[1, 2], [3, 4], [5, 6.0]]))
    assert names == ("b", "a")
    assert frame.tolist() == [1, 3]
    assert twice == 0
    np.testing.assert_array_equal(b, [[[np.nan, np.nan], [3, 4]], [[1, 2], [5, 6]]])
    assert of_rows("a.csv", [1, 1], ["a", "a"], np.zeros((2, 2)))[3] == 1


def test_a_convention_is_made_of_what_the_config_has():
    said = Convention.of({"first_pixel": [0.5, 0.5], "size": [640, 480], "origin": "lower-left"})
    assert said == Convention(origin="lower-left", first=(0.5, 0.5), size=(640, 480))


def test_a_frame_between_two_is_refused_for_it_may_be_a_time():
    with pytest.raises(VidtrackError, match=r"a.csv: frame 0.5 is no whole number"):
        of_rows("a.csv", [0, 0.5], ["a", "a"], np.zeros((2, 2)))

"""The pattern of what does not fit names its likely cause, and a pattern that is not there names none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu

from vidtrack.calibration.camera.diagnosis import LISTED, LOUD_PX, at_rim, left_out, listed, misfit
from vidtrack.simulate.rig import thesis_points

TAGS, P = thesis_points()
CENTRE = (256.0, 240.0)
RNG = np.random.default_rng(0)
B = np.column_stack([RNG.uniform(0, 512, 64), RNG.uniform(0, 480, 64)])
CLIPS = ["row1"] * 32 + ["row2"] * 32


def outliers(*which):
    out = np.zeros(64, bool)
    out[list(which)] = True
    return out


def cause(out, b=B, clips=CLIPS, p=P):
    found = left_out(TAGS, clips, p, b, out, CENTRE, 12.0, "tsai")
    return found and found.code


def test_nothing_left_out_is_no_finding():
    assert cause(outliers()) is None


def test_scattered_points_are_names_or_places():
    found = left_out(TAGS, CLIPS, P, B, outliers(3, 40), CENTRE, 12.345, "tsai")
    assert found.code == "points-left-out"
    assert found.text == "2 of 64 points left out, up to 12.3 px off: tags 4, 41."


def test_most_of_one_clip_is_a_camera_or_target_that_moved():
    assert cause(outliers(*range(20))) == "clip-off"
    assert cause(outliers(*range(16))) != "clip-off"  # half of it
    assert cause(outliers(*range(20), 50)) != "clip-off"  # another clip has one as well
    assert cause(outliers(*range(20)), clips=["row1"] * 64) != "clip-off"  # there is no other clip


def test_points_at_the_rim_are_the_lens():
    radius = np.hypot(*(B - CENTRE).T)
    farthest = np.argsort(radius)[-6:]
    assert cause(outliers(*farthest)) == "lens-at-rim"
    assert cause(outliers(*farthest[-3:])) != "lens-at-rim"  # too few for a pattern
    assert cause(outliers(*np.argsort(radius)[:6])) != "lens-at-rim"


def test_points_on_one_wire_are_a_wire_surveyed_wrongly():
    wire = [20, 21, 22, 23]  # four balls that hang below each other
    assert cause(outliers(*wire), b=np.tile(CENTRE, (64, 1))) == "wire-off"
    assert cause(outliers(*wire[:3]), b=np.tile(CENTRE, (64, 1))) == "wire-off"
    assert cause(outliers(0, 21, 44), b=np.tile(CENTRE, (64, 1))) != "wire-off"


def test_three_of_a_long_row_of_points_are_no_wire():
    """A line that most of its points lie on correctly is not surveyed wrongly."""
    row = np.column_stack([np.arange(64.0), np.zeros(64), np.zeros(64)])
    assert cause(outliers(10, 30, 50), p=row, b=np.tile(CENTRE, (64, 1))) == "points-left-out"


@settings(max_examples=40)
@given(st.lists(st.floats(0, 400), min_size=4, max_size=30, unique=True), st.integers(1, 3))
def test_how_far_out_they_lie_is_the_area_under_the_receiver_operating_curve(radius, n_out):
    """As Mann and Whitney's U over the number of pairs, by scipy."""
    radius = np.array(radius)
    out = np.zeros(radius.size, bool)
    out[:n_out] = True
    u = mannwhitneyu(radius[out], radius[~out]).statistic / (n_out * (radius.size - n_out))
    assert at_rim(radius, out) == (u > 0.93)


def test_all_points_left_out_lie_at_no_rim():
    assert not at_rim(np.arange(5.0), np.ones(5, bool))


def test_a_message_lists_so_many_tags_and_no_more():
    assert listed(["a", "b"]) == "a, b"
    assert listed([str(i) for i in range(LISTED)]).count(",") == LISTED - 1
    assert listed([str(i) for i in range(LISTED + 1)]).endswith(f"{LISTED - 1}, ...")


def test_noise_as_stated_is_no_finding():
    assert misfit(0.12, 0.1, 0.0, 0.25, 0.0, "in") is None
    assert misfit(float("nan"), 0.1, 0.0, 0.25, 0.0, "in") is None
    assert misfit(0.1, float("nan"), 0.0, 0.25, 0.0, "in") is None


def test_a_survey_error_that_nobody_stated_is_said_in_world_units():
    """0.5 px where 0.3 px of centroids are expected: sqrt(0.5^2 - 0.3^2) = 0.4 px of 0.25 in each."""
    found = misfit(0.5, 0.24, 0.0, 0.25, 0.0, "in")
    assert found.level == "doubtful"
    assert "0.11 in" in found.text
    assert "no survey error at all" in found.text
    assert "calibration.sigma: 0.11" in found.cure
    assert "stated sigma of 0.02 in" in misfit(0.5, 0.24, 0.08, 0.25, 0.02, "in").text


@pytest.mark.parametrize(
    ("noise", "expected", "level"),
    [(0.29, 0.1, None), (0.31, 0.1, "doubtful"), (0.31, 0.16, None), (2.5, 0.3, "doubtful"), (2.5, 0.2, "bad")],
)
def test_how_bad_a_misfit_is(noise, expected, level):
    found = misfit(noise, expected, 0.0, 0.25, 0.0, "in")
    assert (found and found.level) == level
    assert LOUD_PX == 0.3


def test_a_survey_better_than_stated_is_a_note():
    found = misfit(0.1, 0.5, 0.49, 0.25, 0.12, "in")
    assert (found.level, found.code) == ("note", "survey-sigma-large")
    assert misfit(0.1, 0.5, 0.2, 0.25, 0.12, "in") is None  # it is the centroids that are better

from fractions import Fraction

import numpy as np

from vidtrack.timing.frame import Frame
from vidtrack.tracking.pictures.repeats import RepeatedPictures, with_resting
from vidtrack.tracking.state import MEASURED, PREDICTED, REPEATED, SD_X, SD_Y, Rows, present


def frames(pictures):
    return [Frame(i, Fraction(i, 30), picture, False, None) for i, picture in enumerate(pictures)]


def test_only_the_very_same_picture_repeats_one():
    rng = np.random.default_rng(0)
    a, b = rng.integers(0, 255, (2, 40, 60), np.uint8)
    nearly = b.copy()
    nearly[33, 17] ^= 1
    repeats = RepeatedPictures()
    given = frames([a, a.copy(), b, nearly, nearly, a])
    assert list(repeats.over(given)) == given
    assert repeats.flags == [False, True, False, False, True, False]
    assert repeats.indices == {1, 4}


def rows_of(x, repeated):
    """One target at x (k,) px; in repeated samples nothing was measured."""
    values = np.ones((MEASURED, len(x), 1))
    values[:2, :, 0] = x
    values[[SD_X, SD_Y]] = 0.01
    values[:, repeated] = np.nan
    flag = np.where(repeated, REPEATED | PREDICTED, 0)[:, None]
    return Rows(values, np.zeros((len(x), 1, 2)), flag, np.zeros(len(x)))


def measured(x, which, lines=1):
    repeated = np.isin(np.arange(len(x)), which)
    got = with_resting(rows_of(np.asarray(x, float), repeated), repeated, lines)
    assert (present(got) == (got.flag == 0)).all()
    return present(got)[:, 0].tolist()


def test_what_rests_before_and_after_is_measured_in_between():
    assert measured([5, 5, 5, 5.02, 5], [2]) == [True] * 5
    assert measured([5, 5, 5, 5, 5, 5], [2, 3, 4]) == [True] * 6


def test_what_moves_is_not():
    assert measured([1, 2, 3, 4, 5], [2]) == [True, True, False, True, True]
    assert measured([1, 2, 3, 4, 5, 6], [2, 3]) == [True, True, False, False, True, True]


def test_at_the_end_the_last_step_tells():
    assert measured([1, 2, 3, 4, 5], [4]) == [True] * 4 + [False]
    assert measured([5, 5, 5, 5, 5], [4]) == [True] * 5


def test_both_fields_of_a_frame_repeat_those_of_the_frame_before():
    still = [5.0] * 6
    assert measured(still, [2, 3], lines=2) == [True] * 6


def test_a_first_picture_has_none_before():
    assert measured([5, 5, 5], [0]) == [False, True, True]

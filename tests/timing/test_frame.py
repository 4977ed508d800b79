"""What a recording says of itself: its rate, and the one that its file states."""

from fractions import Fraction

from vidtrack.timing.frame import VideoInfo


def test_without_another_word_the_file_states_the_rate_that_is_used():
    assert VideoInfo(4, 3, Fraction(30000, 1001)).stated_rate == Fraction(30000, 1001)


def test_a_recording_slowed_down_by_its_file_counts_its_code_at_the_rate_stated():
    """240 pictures a second of the scene, which the file plays at 30: its pace is an eighth."""
    assert VideoInfo(4, 3, Fraction(240), pace=Fraction(1, 8)).stated_rate == 30

"""What a recording says of itself: its rate, and the one that its file states."""

from fractions import Fraction

from vidtrack.geometry.picture_part import Picture, picture_from_record
from vidtrack.timing.frame import BLANK, ReadAccount, VideoInfo


def test_without_another_word_the_file_states_the_rate_that_is_used():
    assert VideoInfo(4, 3, Fraction(30000, 1001)).stated_rate == Fraction(30000, 1001)


def test_a_recording_slowed_down_by_its_file_counts_its_code_at_the_rate_stated():
    """240 pictures a second of the scene, which the file plays at 30: its pace is an eighth."""
    assert VideoInfo(4, 3, Fraction(240), pace=Fraction(1, 8)).stated_rate == 30


def test_the_shape_of_a_picture_is_read_back_as_it_was_written():
    info = VideoInfo(720, 480, Fraction(30), sample_aspect=Fraction(8, 9), rotation=90)
    assert picture_from_record(info.shape) == Picture(720, 480, Fraction(8, 9), 90)


def test_pictures_in_which_targets_are_measured_are_not_blank_and_damage_that_tracking_saw_is_counted():
    account = ReadAccount(10, 0, 2, (f"{BLANK} in 3 of 10", "a gap"))
    assert account.after_tracking(measured=0.0, damaged=1) == account._replace(corrupt=3)
    assert account.after_tracking(measured=0.1, damaged=0).problems == ("a gap",)

"""The account of a reading: what is missing, damaged, blank or repeated, and nothing where all is well."""

from fractions import Fraction

import numpy as np
import pytest

from vidtrack.timing.frame import BLANK, VideoInfo
from vidtrack.timing.timebase import TimeBase
from vidtrack.video.faults.account import ReadingLog

RATE = Fraction(25)


class NoDamage:
    refused = 0
    said = ""


def info(duration=None, bits=8, is_still=False):
    return VideoInfo(64, 48, RATE, bits=bits, duration=duration, is_still=is_still, time=TimeBase(RATE, RATE))


def noisy(k, level=60.0, noise=3.0, top=255):
    """A ball on noise that is new in every picture."""
    rng = np.random.default_rng(k)
    picture = level + rng.normal(0, noise, (48, 64))
    picture[20:26, 10 + k % 40 : 16 + k % 40] += 120
    return np.clip(np.rint(picture), 0, top).astype(np.uint8)


def read(pictures, times=None, corrupt=(), ended=True, damage=NoDamage, **changes):
    log = ReadingLog()
    times = [k / 25 for k in range(len(pictures))] if times is None else times
    for k, (picture, time) in enumerate(zip(pictures, times, strict=True)):
        log.picture(k, time, picture, k in corrupt)
    return log.account(info(**changes), damage, ended=ended)


def test_a_recording_without_fault_has_nothing_to_say():
    assert read([noisy(k) for k in range(80)], duration=Fraction(80, 25)) == (80, 0, 0, ())


def test_gaps_are_counted_and_placed():
    times = [k / 25 for k in range(90) if k not in (10, 11, 40)]
    account = read([noisy(k) for k in range(87)], times)
    assert account.lost == 3
    assert account.problems == ("3 pictures are missing (before frame 10, 38)",)


def test_pictures_before_the_first_that_can_be_decoded_are_missing():
    account = read([noisy(k) for k in range(40)], [(k + 3) / 25 for k in range(40)])
    assert account.lost == 3
    assert "3 pictures are missing (before frame 0)" in account.problems


def test_a_recording_that_ends_before_its_header_says_is_cut_off_unless_reading_stopped_there():
    pictures = [noisy(k) for k in range(40)]
    account = read(pictures, duration=Fraction(50, 25))
    assert account.lost == 10
    assert "the recording ends 10 pictures before its header says" in account.problems[0]
    assert read(pictures, duration=Fraction(50, 25), ended=False).lost == 0
    assert read(pictures, duration=Fraction(41, 25)).lost == 0  # rounding
    assert read(pictures[:1], duration=Fraction(50, 25), is_still=True).lost == 0


def test_damaged_pictures_are_named_in_runs_and_only_counted_beyond_some():
    account = read([noisy(k) for k in range(60)], corrupt={3, 5, 6, 7, 20, 40, 50})
    assert account.corrupt == 7
    (line,) = account.problems
    assert line == "7 pictures are damaged (frame 3, 5 to 7, 20 and 2 places more)"


def test_refused_packets_a_broken_file_and_stamps_that_turn_back_are_said():
    class Damage:
        refused = 2
        said = "bad slice"

    log = ReadingLog()
    for k, time in enumerate([0.0, 0.04, 0.04, 0.12, 0.16]):
        log.picture(k, time, noisy(k), False)
    log.broken_off(OSError(5, "Input/output error"))
    log.other_size()
    log.noted("two streams")
    said = log.account(info(), Damage).problems
    assert said[0] == "two streams"
    assert "2 packets refused by the decoder (bad slice)" in said
    assert "the file could not be read everywhere (Input/output error)" in said
    assert "1 time stamp does not move forward" in said
    assert "1 picture of another size left out" in said
    assert log.reason(Damage) == " (bad slice)"
    assert log.reason(NoDamage) == " (Input/output error)"
    assert ReadingLog().reason(NoDamage) == ""


@pytest.mark.parametrize(("level", "noise"), [(16, 0.0), (3, 2.0), (128, 2.0)])
def test_a_covered_lens_is_blank_with_noise_or_without(level, noise):
    rng = np.random.default_rng(0)
    pictures = [np.clip(level + rng.normal(0, noise, (48, 64)), 0, 255).astype(np.uint8) for _ in range(40)]
    (line,) = read(pictures).problems
    assert line.startswith(f"{BLANK} in all ")


def test_one_small_bright_target_is_no_blank_picture():
    rng = np.random.default_rng(0)
    pictures = [np.clip(20 + rng.normal(0, 2.0, (48, 64)), 0, 255).astype(np.uint8) for _ in range(40)]
    for k, picture in enumerate(pictures):
        picture[10:12, k : k + 2] = 60
    assert read(pictures).problems == ()


def test_the_depth_of_the_levels_is_counted():
    rng = np.random.default_rng(0)
    pictures = [(200 + rng.normal(0, 8.0, (48, 64))).astype(np.uint16) for _ in range(40)]
    assert read(pictures, bits=10).problems[0].startswith(BLANK)


@pytest.mark.parametrize(
    ("shown", "says"),
    [
        (lambda k: 0, "the same picture over and over"),
        (lambda k: k if k < 100 else 100, "nothing changes from picture to picture from about frame"),
        (lambda k: k, None),
    ],
)
def test_a_recording_that_is_stuck_is_said(shown, says):
    problems = read([noisy(shown(k)) for k in range(400)]).problems
    assert (says in problems[0]) if says else problems == ()


def test_pictures_that_a_change_of_rate_repeated_are_estimated():
    """Every fourth picture twice: one of five repeats the one before."""
    pictures = [noisy(k - k // 5) for k in range(1000)]
    (line,) = read(pictures).problems
    share = int(line.split("%")[0].split()[-1])
    assert 10 < share < 35
    assert "a converted frame rate" in line

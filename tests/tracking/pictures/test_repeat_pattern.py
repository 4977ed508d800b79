"""Pulldown and other conversions of the rate show in the tracks, steady and swinging motion does not."""

import numpy as np
import pytest

from vidtrack.tracking.pictures.repeat_pattern import Pattern, pattern_findings, repeat_pattern

SD = 0.03


def course(n=120, hz=0.7, rate=60.0, targets=2, amplitude=40.0, seed=1):
    """Positions (n, targets, 2) px of targets that swing, without noise."""
    t = np.arange(n) / rate
    swing = amplitude * np.sin(2 * np.pi * hz * t[:, None] + np.arange(targets))
    return np.stack([100 + swing, 80 + 0.3 * swing], -1)


def seen(path, seed=1):
    return path + np.random.default_rng(seed).normal(0, SD, path.shape)


def repeated(path, counts):
    """Each sample as many times as `counts` says, in turn."""
    return seen(path[np.repeat(np.arange(len(path)), np.resize(counts, len(path)))])


def found(where):
    return repeat_pattern(where, np.full(where.shape, SD))


@pytest.mark.parametrize(
    ("counts", "pattern"),
    [([2, 3], Pattern(5, 2)), ([1, 1, 1, 2], Pattern(5, 4)), ([2], Pattern(2, 1)), ([1, 2], Pattern(3, 2)),
     ([1, 1, 1, 1, 2], Pattern(6, 5))],
)  # fmt: skip
def test_the_pattern_is_found_whatever_its_beginning(counts, pattern):
    where = repeated(course(), counts)
    assert found(where) == pattern
    assert found(where[3:]) == pattern
    lost = where.copy()
    lost[20:31] = np.nan
    assert found(lost) == pattern


@pytest.mark.parametrize("hz", [0.0, 0.2, 0.7, 3.0, 6.0, 10.0, 12.0, 15.0, 20.0, 29.0])
@pytest.mark.parametrize("drift", [0.0, 0.5, 3.0])
def test_targets_that_swing_and_drift_are_no_pattern(hz, drift):
    path = course(hz=hz) + drift * np.arange(120)[:, None, None]
    assert found(seen(path)) is None


def test_single_repeats_a_jump_and_few_samples_are_no_pattern():
    path = course()
    jump = path.copy()
    jump[60:] += 30.0
    for where in (seen(jump), seen(path[np.sort(np.r_[np.arange(120), 5:110:9])]), seen(path[:15]), seen(path[:, :0])):
        assert found(where) is None


def test_two_fields_of_one_picture_are_no_repeat():
    where = repeated(course(), [2])
    assert pattern_findings(where, np.full(where.shape, SD), 60.0, fields=True) == []
    assert pattern_findings(where, np.full(where.shape, SD), 60.0, fields=False)


def test_what_the_user_reads_names_both_rates():
    where = repeated(course(), [2, 3])
    (finding,) = pattern_findings(where, np.full(where.shape, SD), 60.0, fields=True)
    assert (finding.level, finding.code) == ("bad", "pictures-repeat-in-pattern")
    assert "of every 5 fields in a row 3 show nothing new: 24 pictures a second" in finding.text
    assert pattern_findings(seen(course()), np.full(course().shape, SD), 60.0, fields=True) == []

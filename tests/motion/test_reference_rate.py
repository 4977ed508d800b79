"""A wrong rate of pictures, by a contact sensor's record."""

import numpy as np
import pytest

from vidtrack.motion.lag import find_lag
from vidtrack.motion.reference_rate import picture_rate

TR = np.arange(-2, 8, 1 / 100)


def motion(t):
    return np.exp(-0.05 * t) * np.sin(2 * np.pi * 0.7 * t) + 0.3 * np.sin(2 * np.pi * 0.31 * t + 1)


def found(true, stated, noise=0.01, seconds=5.0, other=motion):
    rng = np.random.default_rng(round(true))
    taken = np.arange(int(seconds * true)) / true
    t, video = 36000 + np.arange(len(taken)) / stated, motion(taken) + rng.normal(0, noise, len(taken))
    tr, r = 36000 + TR, other(TR) + rng.normal(0, noise, len(TR))
    return picture_rate(tr, r, t, video, find_lag(tr, r, t, video))


@pytest.mark.parametrize(
    ("true", "stated"), [(30000 / 1001, 25.0), (25.0, 30.0), (120.0, 30.0), (60.0, 50.0), (24.0, 25.0)]
)
def test_the_rate_that_pictures_came_at_is_named(true, stated):
    finding = found(true, stated)
    assert (finding.level, finding.code) == ("bad", "picture-rate-wrong")
    named = float(finding.text.split(" came at ")[1].split()[0])
    assert named == pytest.approx(true, rel=0.002)
    assert f"instead of {stated:.4g}" in finding.text


def test_records_that_agree_or_never_do_have_no_other_rate():
    assert found(30.0, 30.0) is None
    assert found(30.0, 30.0, noise=0.5) is None
    assert found(30.0, 29.97) is None
    rng = np.random.default_rng(4)
    assert found(30.0, 30.0, other=lambda t: np.cumsum(rng.normal(0, 1, len(t)))) is None
    assert found(30.0, 30.0, other=lambda t: np.sin(2 * np.pi * 1.1 * t)) is None


def test_too_few_samples_and_none_say_nothing():
    assert found(30.0, 25.0, seconds=0.4) is None
    t = np.arange(60) / 30
    nothing = np.full(60, np.nan)
    assert picture_rate(TR, motion(TR), t, nothing, find_lag(TR, motion(TR), t, nothing)) is None

"""Records of waves and responses: what is measured, and what is left out."""

import numpy as np

from vidtrack.analysis.harmonics import fit_harmonics, fundamental_frequency
from vidtrack.analysis.responses import Series, irregular_waves, regular_waves


def series(t, x):
    return Series(t, x, np.full(len(t), np.nan), "m")


def test_a_motion_that_does_not_move_has_no_response():
    t = np.arange(0, 40, 1 / 60)
    wave = series(t, np.cos(2 * np.pi * 0.5 * t))
    f = fundamental_frequency(wave.t, wave.x)
    still, moving = series(t, np.full(t.shape, 2.0)), series(t, 3 * wave.x)
    record = regular_waves(wave, f, fit_harmonics(wave.t, wave.x, f.value), {"still": still, "moving": moving})
    assert list(record["responses"]) == ["moving"]
    assert abs(record["responses"]["moving"]["rao"]["value"] - 3) < 1e-6


def test_a_motion_with_many_gaps_has_no_transfer_function():
    t = np.arange(0, 120, 1 / 20)
    rng = np.random.default_rng(0)
    wave = series(t, rng.normal(size=t.size))
    x = 2 * wave.x
    x[::10] = np.nan
    record, findings = irregular_waves(wave, {"gaps": series(t, x), "whole": series(t, 2 * wave.x)}, {}, "eta")
    assert list(record["responses"]) == ["whole"]
    assert findings == []

"""One run's wave: the stretch that is used, its kind, and what makes it doubtful."""

import numpy as np
import pytest

from vidtrack.analysis.responses import Series
from vidtrack.analysis.waves import waves_and_responses

F = 0.5


def series(t, x, filmed=True):
    return Series(t, x, np.full(t.size, 0.01 if filmed else np.nan), "m")


def gauge(length=40.0, start=0.0, rate=120.0, f=F):
    t = start + np.arange(0, length, 1 / rate)
    return series(t, 1.5 * np.cos(2 * np.pi * f * t), filmed=False)


def codes(findings):
    return [finding.code for finding in findings]


def test_a_steady_wave_is_regular_and_nothing_is_wrong_with_it():
    t = np.arange(0, 40, 1 / 120)
    record, findings = waves_and_responses("eta", gauge(), {"b.heave": series(t, np.sin(2 * np.pi * F * t))}, {}, "m")
    assert record["kind"] == "regular"
    assert record["H"]["value"] == pytest.approx(3.0, abs=1e-3)
    assert record["H_crossings"]["mean"] == pytest.approx(3.0, abs=5e-3)
    assert record["responses"]["b.heave"]["phase_deg"]["value"] == pytest.approx(90, abs=0.1)
    assert findings == []


def test_fewer_than_a_hundred_samples_a_period_are_noted_whoever_has_them():
    t = np.arange(0, 40, 1 / 30)
    _, findings = waves_and_responses("eta", gauge(), {"b.heave": series(t, np.sin(2 * np.pi * F * t))}, {}, "m")
    assert codes(findings) == ["few-samples-a-period"]
    assert "60 samples a period of b.heave" in findings[0].text


def test_few_whole_periods_make_the_wave_doubtful():
    _, findings = waves_and_responses("eta", gauge(length=7.0), {}, {}, "m")
    assert codes(findings) == ["few-periods"]
    assert findings[0].level == "doubtful"


def test_a_record_without_a_wave_is_a_finding_and_no_number():
    record, findings = waves_and_responses("eta", gauge(length=1.0), {}, {}, "m")
    assert codes(findings) == ["wave-not-found"]
    assert "H" not in record


def test_the_film_s_time_rules_and_that_of_other_instruments_does_not():
    """A load cell that ran on through the calm after the waves does not bring the calm in."""
    wave = gauge(length=80.0)
    wave.x[wave.t > 40] = 0.0
    t = np.arange(10, 38, 1 / 120)
    others = {"b.heave": series(t, np.sin(2 * np.pi * F * t)), "load": series(wave.t, wave.x, filmed=False)}
    record, _ = waves_and_responses("eta", wave, others, {}, "m")
    assert record["H"]["value"] == pytest.approx(3.0, abs=1e-3)
    assert record["periods"] in (13, 14)
    given, _ = waves_and_responses("eta", wave, others, {"start": 20.0, "end": 30.05}, "m")
    assert given["periods"] == 5


def test_a_sea_of_many_waves_is_irregular():
    rng = np.random.default_rng(2)
    t = np.arange(0, 300, 0.05)
    angle = 2 * np.pi * np.outer(t, rng.normal(0.4, 0.08, 100)) + rng.uniform(0, 6.28, 100)
    record, findings = waves_and_responses("eta", series(t, np.cos(angle).sum(1), filmed=False), {}, {}, "m")
    assert record["kind"] == "irregular"
    assert record["H110"] > record["H13"] > record["Hm0"] / 2
    assert findings == []

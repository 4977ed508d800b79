from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.timing.run_scale import code_as_record, code_from_record, run_scale
from vidtrack.timing.timebase import time_base
from vidtrack.timing.timecode import Timecode, frames_in_day, parse

NTSC = Fraction(30000, 1001)
FILM = Fraction(24000, 1001)


def at(label: str, rate: Fraction = NTSC) -> Timecode:
    return parse(label, rate)


def test_two_cameras_a_minute_apart_are_counted_over_the_exact_rate():
    """60 s of labels are 1800 frames, which last 60.06 s: the later camera's own reading is 0.06 s short."""
    scale = run_scale({"a": at("10:00:00:00"), "b": at("10:01:00:00")})
    assert scale.shift["a"] == 0
    assert scale.shift["b"] == pytest.approx(0.06, abs=1e-9)
    assert "10:00:00:00" in scale.note
    assert scale.findings == ()


def test_the_earliest_first_label_is_the_one_that_is_read_as_a_clock():
    early, late = at("10:00:54:00"), at("10:00:59:15")
    scale = run_scale({"late": late, "early": early})
    times = {
        name: float(time_base(NTSC, code).seconds(0.0)) + scale.shift[name]
        for name, code in {"late": late, "early": early}.items()
    }
    assert times["early"] == 36054.0  # as the thesis's sensor record has that moment
    assert times["late"] == pytest.approx(36054 + 165 * 1001 / 30000, abs=1e-9)


@pytest.mark.parametrize("rate", [Fraction(24), Fraction(25), Fraction(30), Fraction(50)])
def test_codes_that_keep_up_with_a_clock_are_left_as_they_are(rate):
    scale = run_scale({"a": at("10:00:00:00", rate), "b": at("11:00:00:00", rate), "c": None})
    assert scale.shift == {"a": 0, "b": 0, "c": 0}


def test_drop_frame_is_left_as_it_is():
    scale = run_scale({"a": at("10:00:00;00"), "b": at("11:00:00;00")})
    assert scale.shift == pytest.approx({"a": 0, "b": 0}, abs=1e-9)


@given(st.integers(0, 2_591_999), st.integers(0, 100_000), st.sampled_from([NTSC, FILM, Fraction(60000, 1001)]))
def test_as_many_frames_as_lie_between_two_labels_lie_between_their_times(first, apart, rate):
    first %= frames_in_day(rate) - 100_001
    codes = {"a": Timecode(first, rate), "b": Timecode(first + apart, rate)}
    shift = run_scale(codes).shift
    time = {name: float(code.clock) + shift[name] for name, code in codes.items()}
    assert time["b"] - time["a"] == pytest.approx(float(apart / rate), abs=1e-6)
    assert time["a"] == pytest.approx(float(Fraction(first, round(rate))), abs=1e-9)


@pytest.mark.parametrize(
    ("before", "after", "rate"), [("23:59:58:00", "00:00:01:00", NTSC), ("23:59:58:00", "00:00:01:00", 25)]
)
def test_a_label_behind_midnight_is_the_next_day_s(before, after, rate):
    codes = {"a": at(before, Fraction(rate)), "b": at(after, Fraction(rate))}
    shift = run_scale(codes).shift
    times = {name: float(code.clock) + shift[name] for name, code in codes.items()}
    assert times["b"] - times["a"] == pytest.approx(3 * round(rate) / float(rate), abs=1e-6)
    assert times["a"] == 86398


def test_codes_of_two_kinds_are_said_to_be_and_how_far_they_may_be_apart():
    scale = run_scale({"a": at("10:00:00:00"), "b": at("10:00:00;00")}, "runs.pluck")
    (finding,) = scale.findings
    assert finding.code == "time-code-kinds-differ"
    assert finding.level == "doubtful"
    assert "36.00 s apart" in finding.text
    assert scale.shift["a"] == 0


def test_codes_of_two_rates_that_both_keep_up_are_no_matter():
    assert run_scale({"a": at("10:00:00:00", Fraction(25)), "b": at("10:00:00;00")}).findings == ()


def test_non_drop_codes_of_two_rates_share_the_scale():
    """At 29.97 and 59.94, as much code has passed since midnight at both."""
    codes = {"a": at("10:00:00:00"), "b": at("10:01:00:00", Fraction(60000, 1001))}
    shift = run_scale(codes).shift
    assert float(codes["b"].clock) + shift["b"] == pytest.approx(36060.06, abs=1e-9)


def test_without_time_code_there_is_nothing_to_say():
    assert run_scale({"a": None, "b": None}) == ({"a": 0.0, "b": 0.0}, "", ())


def test_a_code_survives_being_written():
    code = at("10:00:54:00")
    assert code_from_record({"time": {"code": code_as_record(code)}}) == code
    assert code_from_record({"time": {"code": code_as_record(None)}}) is None
    assert code_from_record({}) is None

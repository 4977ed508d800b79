"""Where a run's own numbers make it doubtful or bad, and where they do not."""

import pytest

from vidtrack.verdict.run_rules import (
    Track,
    comparison_findings,
    location_findings,
    motion_findings,
    picture_findings,
    target_findings,
    time_findings,
)

WHOLE = Track(300, 300, 0.0, 36000.0)


def codes(findings):
    return [(finding.level, finding.code) for finding in findings]


def test_all_targets_in_all_samples_are_no_finding():
    assert target_findings({"a": WHOLE, "b": WHOLE}, ["a", "b"]) == []
    assert target_findings({"a": WHOLE}, None) == []


@pytest.mark.parametrize("asked", [3, ["a", "b", "c"]])
def test_a_run_that_locates_one_of_three_targets_is_bad(asked):
    (finding,) = target_findings({"a": WHOLE, "b": Track(300, 0, 10.0, 36000.0)}, asked)
    assert (finding.level, finding.code) == ("bad", "targets-missing")
    assert "1 of 3 targets" in finding.text
    assert ("b, c never" in finding.text) == isinstance(asked, list)
    assert finding.cure


def test_of_all_targets_none_is_missing_but_where_there_are_none():
    assert target_findings({"t1": WHOLE, "t2": WHOLE}, "all") == []
    assert codes(target_findings({}, "all")) == [("bad", "targets-missing")]


def test_a_stretch_of_one_of_two_targets_is_no_third_one():
    short = Track(60, 60, 0.0, 36000.0)
    assert codes(target_findings({"a": WHOLE, "a|b": short}, 2)) == [("bad", "targets-missing")]
    assert target_findings({"a": WHOLE, "b": WHOLE, "a|b": short}, ["a", "b"]) == []


def test_targets_that_nothing_was_made_of_are_missing():
    assert codes(target_findings({}, 1)) == [("bad", "targets-missing")]


@pytest.mark.parametrize(("located", "level"), [(299, None), (270, "doubtful"), (100, "bad")])
def test_the_share_of_located_samples_is_graded(located, level):
    found = target_findings({"a": Track(300, located, 0.5, 36002.5)}, 1)
    assert [finding.level for finding in found] == ([level] if level else [])
    if found:
        assert f"{located} of 300" in found[0].text
        assert "0.5 s, from 10:00:02.5" in found[0].text


def test_a_gap_longer_than_a_second_is_a_doubt_however_long_the_run():
    assert codes(target_findings({"a": Track(30000, 29900, 3.0, 36000.0)}, 1)) == [("doubtful", "gap-long")]
    assert target_findings({"a": Track(30000, 29900, 0.2, 36000.0)}, 1) == []


@pytest.mark.parametrize(("lost", "corrupt", "level"), [(1, 0, None), (6, 4, "doubtful"), (150, 10, "bad")])
def test_the_share_of_pictures_lost_is_graded(lost, corrupt, level):
    found = picture_findings("c", {"reading": {"frames": 100, "lost": lost, "corrupt": corrupt}})
    assert [f.level for f in found] == ([level] if level else [])


def test_pictures_that_are_missing_may_never_have_been_recorded_and_damaged_ones_were():
    missing, damaged = (
        picture_findings("c", {"reading": {"frames": 100, **gone}}) for gone in ({"lost": 50}, {"corrupt": 50})
    )
    assert "constant rate" in missing[0].cure
    assert damaged[0].cure == "Copy the recording again from the camera or tape."


def timed(*sources):
    return {f"cam{i}": {"time": {"source": source}} for i, source in enumerate(sources)}


def test_cameras_with_and_without_time_code_share_no_time():
    assert time_findings(timed("tmcd", "ltc"), {}) == []
    assert codes(time_findings(timed("tmcd", "none"), {})) == [("bad", "time-codes-mixed")]
    sought = {"clocks": {"cameras": {"cam1": {"source": "motion", "offset_s": 0.1}}}}
    assert time_findings(timed("tmcd", "none"), sought) == []


def test_recordings_without_any_time_code_are_only_assumed_to_begin_together():
    assert codes(time_findings(timed("none", "none"), {})) == [("doubtful", "clock-unknown")]
    given = {"clocks": {"cameras": {"cam1": {"source": "config", "offset_s": 0.2}}}}
    assert time_findings(timed("none", "none"), given) == []
    assert time_findings(timed("none"), {}) == []


@pytest.mark.parametrize(
    ("late", "sd", "level"), [(0.0, 2e-3, "note"), (0.007, 2e-3, "doubtful"), (0.0, 3e-3, "doubtful")]
)
def test_recordings_said_to_begin_together_count_where_the_motion_shows_it(late, sd, level):
    """At 40 px/s and 0.2 in a px a delay of 2 ms is 0.016 in, and positions have a sigma of 0.017 in."""
    lines = {"late_s": {"cam1": 0.0, "cam2": late}, "late_sd_s": {"cam1": 0.0, "cam2": sd}, "speed_px_s": 40.0}
    (finding,) = time_findings(timed("none", "none"), {**located(), "sight_lines": lines})
    assert finding.level == level
    assert ("within 4 ms" in finding.text) == (level == "note")


def located(**changes):
    record = {
        "units": "in",
        "noise": {"sd_px": {"cam1": 0.02, "cam2": 0.03}, "reprojection_rms_px": {"cam1": 0.03, "cam2": 0.03}},
        "samples": {"n": 100, "located": 100, "disagree": 0, "mean_sigma": [0.01, 0.01, 0.01]},
        "correspondence": {"world_per_px": 0.2},
        "volume": {"share_outside": 0.0, "farthest_outside": 0.0},
    }
    return {**record, **changes}


def test_a_run_located_as_its_calibration_leads_to_expect_is_no_finding():
    assert location_findings(located(), 0.05) == []
    assert location_findings({"samples": 13}, None) == []


def test_a_sigma_far_beyond_the_calibrations_is_a_doubt():
    samples = {"n": 100, "located": 100, "disagree": 0, "mean_sigma": [0.01, 0.01, 0.9]}
    (finding,) = location_findings(located(samples=samples), 0.05)
    assert finding.code == "sigma-large"
    samples = {**samples, "mean_sigma": None}
    assert location_findings(located(samples=samples), 0.05) == []


def test_the_axis_that_scatters_most_over_its_sigma_is_named():
    smoothing = [
        {"target": "a", "axis": "x", "noise_ratio": 1.2},
        {"target": "a", "axis": "z", "noise_ratio": 4.0},
        {"target": "b", "axis": "x", "noise_ratio": None},
    ]
    (finding,) = motion_findings({"smoothing": smoothing})
    assert finding.text == "target a: positions scatter along z by 4 times their sigma"
    assert motion_findings({}) == []


def test_a_reference_of_another_motion_and_a_truth_far_off_are_findings():
    assert comparison_findings({"after": {"correlation": 0.999}, "truth": {"normalised_variance": {"x": 1.2}}}) == []
    assert codes(comparison_findings({"after": {"correlation": 0.7}})) == [("doubtful", "reference-differs")]
    assert codes(comparison_findings({"after": {"correlation": -0.9}})) == [("bad", "reference-differs")]
    (turned,) = comparison_findings({"after": {"correlation": -0.99}})
    assert turned.text.startswith("the reference counts against the video")
    assert "Change the sign" in turned.cure
    (finding,) = comparison_findings({"truth": {"normalised_variance": {"x": 49.0, "y": None}}})
    assert (finding.level, finding.text) == ("doubtful", "positions are off truth.csv by 7 sigma rms along x")

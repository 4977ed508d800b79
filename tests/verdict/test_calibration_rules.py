"""Where a calibration's own numbers make it doubtful or bad, and where they do not."""

import math

import pytest
from scipy.stats import chi2

from vidtrack.verdict.calibration_rules import (
    Fit,
    by_chance,
    camera_findings,
    graded,
    square_findings,
    stretch_findings,
    unfound_findings,
    whole_findings,
)

CAMERA = {"rms_px": 0.2}


def codes(findings):
    return [(finding.level, finding.code) for finding in findings]


@pytest.mark.parametrize(
    ("value", "level"), [(None, None), (math.nan, None), (1.0, None), (1.1, "doubtful"), (3.1, "bad")]
)
def test_a_number_is_graded_by_two_limits_and_an_unknown_one_is_not(value, level):
    assert graded(value, (1.0, 3.0)) == level


def test_points_that_fit_as_noise_and_survey_allow_are_no_finding():
    assert camera_findings("cam1", CAMERA, Fit(64, 64, 1.05), {"points": 64, "found": 64}) == []


@pytest.mark.parametrize(("misfit", "level"), [(1.7, "doubtful"), (9.0, "bad")])
def test_residuals_beyond_noise_and_survey_are_graded(misfit, level):
    (finding,) = camera_findings("cam1", {"rms_px": 0.4}, Fit(64, 64, misfit), {})
    assert (finding.level, finding.code) == (level, "residuals-unexplained")
    assert finding.text.startswith("cam1: ")
    assert "calibration.model: auto" in finding.cure


@pytest.mark.parametrize("fit", [Fit(64, 64, 9.0), Fit(64, 64, math.nan), Fit(64, 30, 1.0)])
def test_who_has_set_auto_already_is_not_told_to_set_it(fit):
    record = {"rms_px": 9.0}
    assert "auto" in camera_findings("cam1", record, fit, {})[0].cure
    assert "auto" not in camera_findings("cam1", record | {"settings": {"model": "auto"}}, fit, {})[0].cure


@pytest.mark.parametrize("freedom", [3, 13, 40, 120])
def test_chance_exceeds_its_limit_once_in_ten_thousand_times(freedom):
    """Against scipy's chi-squared; the cube is good to a fifth of the probability."""
    exceeded = chi2.sf(by_chance(freedom) ** 2 * freedom, freedom)
    assert 0.7e-4 < exceeded < 1.5e-4


def test_a_few_points_may_fit_worse_by_chance():
    assert camera_findings("c", CAMERA, Fit(12, 12, 1.7, 13), {}) == []
    assert camera_findings("c", CAMERA, Fit(12, 12, 1.9, 13), {})[0].level == "doubtful"


def test_without_a_survey_tolerance_the_residual_itself_is_judged():
    assert codes(camera_findings("c", {"rms_px": 3.2}, Fit(9, 9, math.nan), {})) == [("bad", "residuals-large")]
    assert camera_findings("c", {"rms_px": 0.8}, Fit(9, 9, math.nan), {}) == []


def test_many_points_left_out_blame_the_model_not_the_points():
    assert camera_findings("c", CAMERA, Fit(64, 60, 1.0), {}) == []
    (finding,) = camera_findings("c", CAMERA, Fit(64, 23, 1.0), {})
    assert (finding.level, finding.code) == ("bad", "points-left-out")
    assert "41 of the 64" in finding.text


def test_tags_that_were_not_found_are_counted():
    assert codes(camera_findings("c", CAMERA, Fit(30, 30, 1.0), {"points": 64, "found": 30})) == [
        ("doubtful", "points-not-found")
    ]


def test_the_clip_in_which_most_tags_are_missing_is_named_with_what_it_shows_instead():
    clips = {
        "front": {"tags": 12, "found": 11, "blobs_of_no_tag": []},
        "rear": {"tags": 12, "found": 0, "blobs_of_no_tag": [[1.0, 2.0]] * 9},
    }
    (finding,) = camera_findings("c", CAMERA, Fit(11, 11, 1.0), {"points": 24, "found": 11, "clips": clips})
    assert finding.text.endswith("found in the picture; in clip rear 0 of 12, where 9 blobs lie elsewhere")


def back(**changes):
    record = {"held_out": {"mean_3d": 0.054}, "floor": {"mean_3d": 0.001, "mean_3d_with_survey": 0.05}, "units": "in"}
    return {**record, "ratio_with_survey": 1.08, "diagonal_field": 160.5, **changes}


def test_a_calibration_as_good_as_its_survey_allows_is_no_finding():
    assert whole_findings(back()) == []
    assert whole_findings({}) == []


def test_held_out_errors_beyond_the_survey_are_graded():
    (finding,) = whole_findings(back(ratio_with_survey=2.5))
    assert (finding.level, finding.code) == ("doubtful", "held-out-error-unexplained")
    assert whole_findings(back(ratio_with_survey=50.0, floor={"mean_3d": 0.001, "mean_3d_with_survey": 0.001})) == []


def test_held_out_errors_of_a_fiftieth_of_the_field_are_bad():
    (finding,) = whole_findings(back(held_out={"mean_3d": 4.0}))
    assert (finding.level, finding.code) == ("bad", "held-out-error-large")
    assert "1/40 of the diagonal field" in finding.text


def test_a_point_that_each_of_two_cameras_misses_is_named_as_the_survey_s_fault():
    (finding,) = unfound_findings({"a": {"1": True, "18": False}, "b": {"1": True, "18": False}})
    assert finding.level == "doubtful"
    assert "point 18 " in finding.text


def test_a_point_hidden_from_one_camera_or_listed_by_one_alone_is_no_finding():
    assert unfound_findings({"a": {"1": True, "18": False}, "b": {"1": True, "18": True}}) == []
    assert unfound_findings({"a": {"1": True, "18": False}, "b": {"1": True}}) == []


def test_where_no_point_of_a_clip_is_found_the_clip_is_asked_about_and_not_each_survey():
    seen = {str(n): n < 5 for n in range(1, 9)}
    clips = {"front": {"1", "2", "3", "4"}, "rear": {"5", "6", "7", "8", "hidden"}}
    (finding,) = unfound_findings({"a": seen, "b": seen}, clips)
    assert "any point of clip rear" in finding.text
    assert "recordings of two cameras exchanged" in finding.cure
    (finding,) = unfound_findings({"a": seen | {"8": True}, "b": seen}, clips)
    assert "found points 5, 6, 7 where" in finding.text


def squares(*Sx, sd=0.001, dy=0.01):
    records = {f"cam{i}": {"Sx": v, "dx": 0.01, "dy": dy, "standard_errors": {"Sx": sd}} for i, v in enumerate(Sx)}
    return [(f.level, f.code) for f in square_findings(records)]


def test_square_pixels_that_come_out_wide_are_a_doubt_about_the_survey():
    assert squares(1.0, 0.995) == []
    assert squares(1.035, 1.036) == [("doubtful", "pixels-not-square")]
    assert squares(1.035, sd=0.01) == []  # not known well enough
    assert squares(1.035, dy=0.008) == []  # pixels that are not square have whatever the frame grabber gave them


def test_the_pixels_of_video_are_a_note_about_the_sensor():
    assert squares(10 / 11, 10 / 11) == [("note", "pixels-not-square")]
    assert squares(59 / 54 * 1.0 + 0.08, 10 / 11) == [("doubtful", "pixels-not-square")]


def of_sensor(Sx, sensor, held=False, size=(384, 288)):
    """A camera's record with this sensor, mm."""
    dx, dy = sensor[0] / size[0], sensor[1] / size[1]
    return {"Sx": Sx, "dx": dx, "dy": dy, "image_size": size, "standard_errors": {} if held else {"Sx": 0.001}}


def test_a_sensor_whose_width_and_height_are_exchanged_is_named():
    (finding,) = square_findings({"cam1": of_sensor(0.5625, (4.8, 6.4))})
    assert (finding.level, finding.code) == ("note", "sensor-not-as-pixels")
    assert "seem to be exchanged" in finding.text
    assert "[6.4, 4.8]" in finding.cure
    (other,) = square_findings({"cam1": of_sensor(1.2, (7.68, 4.8))})
    assert "exchanged" not in other.text
    assert square_findings({"cam1": of_sensor(1.0, (6.4, 4.8))}) == []
    assert square_findings({"cam1": of_sensor(1.02, (7.0, 4.8))}) == []  # pixels are as the sensor says


def test_where_sx_is_held_the_sensor_is_asked_about_before_the_survey():
    cure = camera_findings("cam1", {"rms_px": 2.0} | of_sensor(1.0, (4.8, 6.4), held=True), Fit(64, 64, 9.0), {})[
        0
    ].cure
    assert cure.startswith("cameras.cam1.sensor makes pixels that are 0.562 times as wide as high")
    for record in (of_sensor(1.0, (6.4, 4.8), held=True), of_sensor(0.56, (4.8, 6.4))):
        assert "sensor" not in camera_findings("cam1", {"rms_px": 2.0} | record, Fit(64, 64, 9.0), {})[0].cure


def stretch(kind, share, sd=0.001, gain=400.0):
    return {"kind": kind, "share": share, "sd": sd, "gain": gain}


def test_a_stretched_survey_names_its_axis_by_how_much_and_what_explains_it_as_well():
    found = [stretch("x", 0.02), stretch("y", -0.018, gain=395.0), stretch("xy", 0.009, gain=80.0)]
    (finding,) = stretch_findings({"stretches": found})
    assert (finding.level, finding.code) == ("doubtful", "survey-stretched")
    assert "x is 2.00% ± 0.10% too long or y is 1.80% ± 0.10% too short" in finding.text
    assert "points.csv" in finding.cure
    (sheared,) = stretch_findings({"stretches": [stretch("xz", -0.02)]})
    assert "the angle between x and z is off by 1.1 deg" in sheared.text


def test_a_stretch_within_its_standard_deviation_or_what_tapes_have_is_no_finding():
    assert stretch_findings({}) == []
    assert stretch_findings({"stretches": []}) == []
    assert stretch_findings({"stretches": [stretch("x", 0.004, sd=0.001)]}) == []
    assert stretch_findings({"stretches": [stretch("x", 0.0025, sd=0.0001)]}) == []

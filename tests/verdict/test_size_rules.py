"""Targets that look larger than the calibration's balls show a lens that is not as it was calibrated."""

import pytest

from vidtrack.verdict.size_rules import size_findings


def sizes(larger, wander=(0.0005, 0.0005, 0.0005)):
    """Of each camera how much larger two targets look, per cent."""
    return {
        "sizes": {
            f"cam{i + 1}": {
                "balls": 36,
                "scatter": 0.002,
                "targets": {
                    "t1": {"n": 60, "larger": percent / 100 + 0.0002, "sd": 0.0006, "wander": own},
                    "t2": {"n": 60, "larger": percent / 100 - 0.0002, "sd": 0.0006, "wander": own},
                },
            }
            for i, (percent, own) in enumerate(zip(larger, wander, strict=False))
        }
    }


NOT_KNOWN = {"cameras": {"cam1": {"since_calibration": None}, "cam2": {"since_calibration": None}}}


def found(*larger, same_balls=True, steadiness=NOT_KNOWN, **more):
    return size_findings(sizes(larger, **more), steadiness, same_balls=same_balls)


@pytest.mark.parametrize(
    "larger", [(0.0, 0.0), (0.2, -0.2), (-0.7, -0.68), (0.3, 0.35, 0.2), (33.0, 33.1), (-12.0, -11.9, -12.1)]
)
def test_the_same_balls_and_quite_other_ones_say_nothing(larger):
    assert found(*larger) == []
    assert size_findings({}, {}, same_balls=True) == []


def test_all_lenses_zoomed_by_a_percent_are_a_doubt():
    (finding,) = found(1.0, 1.05, 0.95)
    assert (finding.level, finding.code) == ("doubtful", "lenses-zoomed")
    assert finding.text.startswith("all cameras see the targets 1.00% ± 0.16% larger than the balls of the calibration")
    assert "calibration.same_balls: false" in finding.cure
    assert found(-0.9)[0].text.startswith("cam1 sees the targets 0.90% ± 0.18% smaller")


def test_other_balls_and_a_background_that_holds_settle_it():
    assert found(1.0, 1.05, same_balls=False) == []
    held = {"cameras": {"cam1": {"since_calibration": {"px": 0.01, "sd": 0.01}}}}
    assert found(1.0, 1.05, steadiness=held) == []


@pytest.mark.parametrize(
    ("larger", "which"),
    [
        ((1.0, 0.0), "cam1 is"),
        ((0.1, -0.05, 0.9), "cam3 is"),
        ((33.0, 34.0), "cam2 is"),
        ((0.0, -1.0, 0.05), "cam2 is"),
    ],
)
def test_a_lens_of_one_camera_is_named(larger, which):
    (finding,) = found(*larger)
    assert (finding.level, finding.code) == ("doubtful", "lens-zoomed")
    assert f"a lens of {which} at another zoom or focus" in finding.text


def test_of_two_cameras_and_other_balls_either_lens_may_be_it():
    (finding,) = found(1.0, 0.0, same_balls=False)
    assert "a lens of cam1 or cam2 is" in finding.text


def test_a_size_that_goes_up_and_down_in_one_camera_is_a_focus_that_hunts():
    (finding,) = found(0.3, 0.0, wander=(0.0106, 0.0006))
    assert (finding.level, finding.code) == ("doubtful", "lens-hunts")
    assert "cam1: the size of the targets wanders by 1.06% rms along the run" in finding.text
    assert found(0.3, 0.0, wander=(0.0106, 0.008)) == []


def test_the_camera_that_wanders_most_is_named_beside_the_one_that_wanders_next():
    (finding,) = found(0.0, 0.0, 0.1, wander=(0.0008, 0.0006, 0.0106))
    assert finding.text.startswith("cam3: the size of the targets wanders by 1.06% rms along the run, in the other ")
    assert "cameras by 0.08% at most" in finding.text
    (finding,) = found(0.0, 0.0, wander=(0.009, 0.002))
    assert finding.text.startswith("cam1")


@pytest.mark.parametrize(("percent", "way"), [(0.9, "larger"), (-0.9, "smaller")])
def test_a_lens_of_one_camera_is_named_with_the_ratio_and_its_way(percent, way):
    (finding,) = found(0.0, percent, 0.0)
    assert f"it sees the targets 0.90% ± 0.12% {way} than the other cameras do" in finding.text


def test_where_the_other_cameras_differ_none_is_the_odd_one():
    assert found(3.0, 0.0, 1.5, same_balls=False) == []


def test_a_ratio_within_five_standard_deviations_is_no_zoom():
    unsure = sizes((0.0, 1.5))
    for target in unsure["sizes"]["cam1"]["targets"].values():
        target["sd"] = 0.006
    assert size_findings(unsure, NOT_KNOWN, same_balls=False) == []


def outlined(*larger, sd=0.003):
    """Of lit balls, per cent: widths of few outlines, which scatter over the balls though these are alike."""
    made = sizes(larger)
    for own in made["sizes"].values():
        own |= {"scatter": 0.007, "among": 0.001, "lasting": 0.0035}
        for target in own["targets"].values():
            target |= {"n": 4, "sd": sd}
    return size_findings(made, NOT_KNOWN, same_balls=True)


def test_what_lasts_in_outlines_is_no_zoom_and_a_zoom_of_all_is_one_though_single_outlines_scatter():
    assert outlined(0.7, 0.7) == []
    assert outlined(-0.75, 0.05) == []
    assert outlined(1.1, -0.4) == []
    assert outlined(1.6) == []
    assert outlined(0.47, 3.03) == []
    (finding,) = outlined(1.3, 1.6)
    assert (finding.level, finding.code) == ("doubtful", "lenses-zoomed")


def test_a_camera_that_is_known_better_counts_for_more():
    made = sizes((0.0, 1.2))
    assert size_findings(made, NOT_KNOWN, same_balls=True)[0].code == "lens-zoomed"
    for target in made["sizes"]["cam1"]["targets"].values():
        target["sd"] = 0.02
    assert size_findings(made, NOT_KNOWN, same_balls=True)[0].code == "lenses-zoomed"

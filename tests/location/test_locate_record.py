"""What a user should look at is told, and nothing else is."""

import copy

import pytest

from vidtrack.location.locate_record import warnings_of

WELL = {
    "correspondence": {
        "tolerance_px": 3.0,
        "targets": {"t1": {"ambiguous": False, "error_px": 0.02, "runner_up_px": 9.0}},
        "unmatched": {},
    },
    "volume": {"share_outside": 0.01, "farthest_outside": 2.0},
    "samples": {"disagree": 0, "mean_miss": 0.05, "mean_miss_where_disagreed": None},
    "noise": {"reprojection_rms_px": {"cam1": 0.19, "cam2": None}, "sd_px": {"cam1": 0.01, "cam2": None}},
}


def told(**changes):
    record = copy.deepcopy(WELL)
    for place, value in changes.items():
        section, key = place.split("__")
        record[section][key] = value
    return warnings_of(record, "in")


def test_a_run_that_went_well_has_no_warnings():
    assert told() == []
    assert warnings_of({**WELL, "volume": None}, "in") == []


@pytest.mark.parametrize(
    ("place", "value", "line"),
    [
        ("correspondence__targets", {}, "targets: no two cameras' tracks agree within 3 px"),
        (
            "correspondence__targets",
            {"a": {"ambiguous": True, "error_px": 0.021, "runner_up_px": 0.034}},
            "target a: another match explains the tracks about as well (0.021 against 0.034 px)",
        ),
        ("correspondence__unmatched", {"cam2": ["t3", "t4"]}, "cam2: no other camera shows the same target as t3, t4"),
        ("volume__share_outside", 0.12, "12 % of the samples lie outside the calibrated volume, by up to 2 in"),
        # 20 times the noise is nothing to speak of below a fifth of a px, and a wrong clock or camera above
        ("noise__reprojection_rms_px", {"cam1": 0.21}, "miss the located points by 0.05 in (0.21 px), far more than"),
    ],
)
def test_each_doubt_is_told_by_its_figures(place, value, line):
    (said,) = told(**{place: value})
    assert line in said


def test_large_errors_that_the_noise_explains_are_none():
    assert told(noise__reprojection_rms_px={"cam1": 0.9}, noise__sd_px={"cam1": 0.2}) == []


def test_samples_on_which_the_cameras_disagree_are_counted():
    (said,) = told(samples__disagree=7, samples__mean_miss_where_disagreed=1.25)
    assert said.startswith("7 samples have no fix: the cameras disagree by more than 3 px")
    assert "1.25 in" in said

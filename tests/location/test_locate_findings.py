"""What the user should know of a located run is found, with its likeliest cause, and nothing else is."""

import copy

import pytest

from vidtrack.location.locate_findings import findings_of

TURNED = {"kind": "turned", "cameras": ["cam2"], "amount": 1.3, "sd": 0.01, "units": "deg", "share": 0.9}
TURNED |= {"evidence": 200.0, "moves_over_sigma": 12.0}
MORE = {"reason": "surplus", "of": "", "start_s": 1.0, "end_s": 4.0, "samples": 90, "place": [1.0, 2.0, -3.0]}
WELL = {
    "correspondence": {
        "tolerance_px": 3.0,
        "targets": {"t1": {"ambiguous": False, "error_px": 0.02, "odds": 1e12, "part_of": []}},
        "besides": [],
        "mirrored": {},
        "unmatched": {},
        "left_over": {},
    },
    "volume": {"share_outside": 0.01, "farthest_outside": 2.0},
    "samples": {"n": 100, "disagree": 0, "mean_miss": 0.05, "mean_miss_where_disagreed": None},
    "noise": {"source": "reprojection"},
    "sight_lines": {
        "px": {"cam1": 0.05, "cam2": 0.1},
        "expected_px": {"cam1": 0.05, "cam2": 0.04},
        "over_sigma": 1.2,
        "cause": TURNED | {"evidence": 2.0},
    },
}


def found(**changes):
    record = copy.deepcopy(WELL)
    for place, value in changes.items():
        section, key = place.split("__")
        record.setdefault(section, {})[key] = value
    return findings_of(record, "in")


@pytest.mark.parametrize(
    ("n", "located", "level"), [(50, 100, "doubtful"), (6, 100, "doubtful"), (4, 60, ""), (5, 100, "")]
)
def test_a_camera_that_is_left_out_of_more_than_a_few_positions_is_named(n, located, level):
    where = {"cam1": {"px": 5.8, "from_s": 36001.0, "to_s": 36002.5}}
    out = found(samples__located=located, samples__left_out={"cam1": n, "cam2": 0}, samples__left_out_where=where)
    assert [one.level for one in out] == [level][: bool(level)]
    if level:
        assert out[0].code == "camera-left-out"
        assert out[0].text.startswith(
            f"cam1: left out of {n} of {located} positions, between 10:00:01.0 and 10:00:02.5"
        )
        assert "miss there by 5.8 px" in out[0].text


def test_a_run_that_went_well_has_none():
    assert found() == []
    assert findings_of({**WELL, "volume": None, "sight_lines": None}, "in") == []


@pytest.mark.parametrize(
    ("place", "value", "level", "text"),
    [
        ("correspondence__targets", {}, "bad", "no two cameras' tracks lie within 3 px"),
        (
            "correspondence__left_over",
            {"cam1": [{"samples": 7, "reason": "contested"}, {"samples": 5, "reason": "alone"}]},
            "doubtful",
            "cam1: 7 samples fit several targets about as well, and are used for none",
        ),
        ("correspondence__unmatched", {"cam2": ["t3", "t4"]}, "doubtful", "the same target as t3, t4"),
        ("correspondence__mirrored", {"t2": "t1"}, "bad", "target t2 is the mirror image of t1"),
        ("correspondence__besides", [MORE | {"reason": "mirror", "of": "t1"}], "note", "mirror images of t1 were seen"),
        (
            "correspondence__besides",
            [MORE, MORE | {"samples": 29}],
            "note",
            "2 things move or stand in space where 1 were asked for; besides these: 1.00 to 4.00 s about (1, 2, -3) in",
        ),
        (
            "correspondence__targets",
            {"t1": {"part_of": []}, "t1|t2": {"part_of": ["t1", "t2"], "start_s": 3.0, "end_s": 4.5}},
            "doubtful",
            "from 3.000 to 4.500 s nothing shows whether what is located as t1|t2 is t1 or t2",
        ),
        ("volume__share_outside", 0.6, "doubtful", "60 % of the samples lie outside the calibrated volume, by up to"),
        ("noise__source", "assumed", "doubtful", "centroid noise that is assumed"),
        ("sight_lines__over_sigma", 4.0, "doubtful", "cam2: lines of sight miss the located points by 0.1 px rms"),
        ("sight_lines__over_sigma", 14.0, "bad", "off by some 14 times what"),
        ("sight_lines__cause", TURNED, "bad", "explained by cam2 turned by 1.3 ± 0.01 deg after its calibration"),
    ],
)
def test_each_doubt_has_its_level_and_its_figures(place, value, level, text):
    (finding,) = found(**{place: value})
    assert finding.level == level
    assert text in finding.text
    assert finding.cure


def test_a_lens_that_is_surely_zoomed_a_little_is_named_though_little_speaks_for_it():
    """A zoom of 0.75 %, known to 17 sd, moved positions by 10 sigma under a verdict of good."""
    zoomed = {"kind": "all zoomed", "cameras": ["cam1", "cam2"], "amount": 0.0075, "sd": 0.00044, "share": 0.92}
    zoomed |= {"evidence": 4.2, "moves_over_sigma": 10.04, "units": "share of f"}
    (finding,) = found(sight_lines__over_sigma=1.9, sight_lines__cause=zoomed)
    assert finding.level == "doubtful"
    assert (
        "off by some 10 times what these lead to expect; it would be explained by all lenses at another zoom"
        in finding.text
    )
    for doubt in ({"sd": 0.002}, {"share": 0.7}):
        assert found(sight_lines__over_sigma=1.9, sight_lines__cause=zoomed | doubt) == []
    assert found(sight_lines__over_sigma=1.4, sight_lines__cause=zoomed) == []


def test_a_camera_that_wanders_by_less_than_a_pixel_is_doubtful_though_no_cause_explains_it():
    """As a stabiliser made it in one of three cameras: a quarter of the samples were off by more than 5 sigma."""
    cause = {"kind": "jumped", "cameras": ["cam1"], "amount": -0.0045, "sd": 0.001, "share": 0.08, "units": "s"}
    cause |= {"evidence": 115.0, "moves_over_sigma": 1.53, "from_s": 2.6}
    (finding,) = found(sight_lines__over_sigma=2.59, sight_lines__cause=cause)
    assert (finding.level, finding.code) == ("doubtful", "sight-lines-miss")
    assert found(sight_lines__over_sigma=1.44, sight_lines__cause=cause) == []


def test_a_cause_that_explains_little_is_not_named():
    cause = TURNED | {"share": 0.05, "moves_over_sigma": 4.0}
    (finding,) = found(sight_lines__over_sigma=5.0, sight_lines__cause=cause)
    assert "turned" not in finding.text
    assert "Neither one late clock nor one turned camera" in finding.cure


def test_a_late_clock_is_cured_by_seeking_it():
    late = TURNED | {"kind": "late", "amount": -0.0167, "sd": 0.0001, "units": "s"}
    (finding,) = found(sight_lines__cause=late)
    assert "a clock of cam2 that is off by 16.7 ± 0.1 ms" in finding.text
    assert finding.cure.startswith("Set cameras.cam2.clock: auto")


def test_a_clock_that_runs_fast_is_cured_by_seeking_it_or_by_its_rate():
    fast = TURNED | {"kind": "fast", "amount": -4990.0, "sd": 60.0, "units": "ppm", "cameras": ["cam2", "cam1"]}
    (finding,) = found(sight_lines__cause=fast)
    assert "a clock of cam2 that runs fast, or of cam1 that runs slow, by 4990 ± 6e+01 ppm" in finding.text
    assert "cameras.cam2.clock: auto, or give its rate_ppm, about -4990;" in finding.cure


def test_a_rate_that_no_crystal_has_is_noted_where_the_motion_gives_it():
    clocks = {"cam1": {"rate_ppm": 0.0, "source": "config"}, "cam2": {"rate_ppm": 4670.0, "source": "motion"}}
    (finding,) = found(clocks__cameras=clocks)
    assert (finding.level, finding.code) == ("note", "clock-rate-large")
    assert "cam2: by the motion its clock runs slow by 4670 ppm" in finding.text
    assert found(clocks__cameras={"cam2": {"rate_ppm": 4670.0, "source": "config"}}) == []
    assert found(clocks__cameras={"cam2": {"rate_ppm": 90.0, "source": "motion"}}) == []


def test_a_clock_that_jumps_is_not_cured_by_an_offset():
    jumped = TURNED | {"kind": "jumped", "amount": 0.0333, "sd": 0.001, "units": "s", "from_s": 36001.25}
    (finding,) = found(sight_lines__cause=jumped)
    assert "off by 33.3 ± 1 ms from about 36001.25 s on" in finding.text
    assert "Compare the recordings of cam1 and cam2 about 36001.25 s" in finding.cure
    assert "offset_s" not in finding.cure


def test_a_clock_that_the_motion_was_asked_for_is_not_to_be_sought():
    late = TURNED | {"kind": "late", "amount": -0.0167, "sd": 0.0001, "units": "s"}
    sought = {name: {"source": "motion"} for name in late["cameras"]}
    (finding,) = found(sight_lines__cause=late, clocks__cameras=sought)
    assert "clock: auto" not in finding.cure
    assert "rate" in finding.cure


def test_samples_on_which_the_cameras_disagree_are_counted():
    (few,) = found(samples__disagree=7, samples__mean_miss_where_disagreed=1.25)
    assert few.text.startswith("7 samples have no position")
    assert "1.25 in" in few.text
    assert few.level == "doubtful"
    assert found(samples__disagree=1, samples__mean_miss_where_disagreed=1.25)[0].level == "note"
    assert found(volume__share_outside=0.3)[0].level == "note"
    (many,) = found(samples__disagree=60, samples__mean_miss_where_disagreed=1.25)
    assert many.level == "bad"


def readouts(**seconds):
    sds = dict.fromkeys(seconds, 0.001)
    return [f.code for f in found(sight_lines__readout_s=seconds, sight_lines__readout_sd_s=sds)]


def test_a_rolling_shutter_is_named_and_what_no_camera_has_is_none():
    assert readouts(cam1=0.0, cam2=0.03) == ["rolling-shutter"]
    assert readouts(cam1=-0.193, cam2=0.03) == []
    assert readouts(cam1=0.0004, cam2=None) == []


def test_samples_that_miss_suddenly_are_counted():
    assert found(samples__sudden_misses=2) == []
    assert [f.level for f in found(samples__sudden_misses=5)] == ["note"]
    assert [f.level for f in found(samples__sudden_misses=20)] == ["doubtful"]


def test_a_camera_that_seldom_measures_what_lies_inside_its_picture_is_a_doubt():
    """A target out of its picture, or that only crosses a corner of it, is none."""
    own = {"inside": 480, "tracked": 120, "sought": 300}
    (one,) = found(
        samples__in_view={"cam2": {"t1": own, "t2": own | {"tracked": 300}}, "cam1": {"t1": own | {"tracked": 470}}}
    )
    assert (one.level, one.code) == ("doubtful", "camera-seldom-measured")
    assert "cam2: t1 was measured in 120 of the 480 samples" in one.text
    assert "300 more by the second search" in one.text
    assert found(samples__in_view={"cam2": {"t1": {"inside": 29, "tracked": 0, "sought": 0}}}) == []


def test_what_explains_a_part_of_the_misses_is_named_as_that():
    sights = {"sight_lines__over_sigma": 8.0, "sight_lines__cause": TURNED | {"share": 0.3}}
    (one,) = found(**sights)
    assert "30% of it would be explained by cam2 turned" in one.text
    assert "zoomed or focused, between the clips of its calibration" in one.cure

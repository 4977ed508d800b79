"""Motion, sound and light together settle a run's clocks."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate
from vidtrack.timing.clock import Clock

RATE, START = 30.0, 36000.0


def pluck(t):
    swing = [24 * np.cos(2 * np.pi * t / 1.6), 0.6 * np.sin(2 * np.pi * t / 0.9), 0.4 * np.cos(2 * np.pi * t / 1.1)]
    return np.exp(-0.1 * t)[:, None] * np.stack(swing, -1)


def steady(t):
    """A swing that repeats every 0.8 s."""
    return np.stack([24 * np.cos(2 * np.pi * t / 0.8), 0 * t, np.sin(2 * np.pi * t / 0.8)], -1)


def rest(t):
    return np.zeros((t.size, 3))


def said(offset_s, sd_s=1e-4, *, rate=0.0, rate_sd=1.0, reference="cam1", at_s=START):
    """What stage clocks tells of a camera."""
    covariance = [[sd_s**2, 0.0], [0.0, rate_sd**2]]
    told = {"reference": reference, "offset_s": offset_s, "rate_ppm": rate, "at_s": at_s, "covariance": covariance}
    return {**told, "n": 5, "of": 5}


def located(path, clock, heard=None, clocks="auto", *, seconds=8.0, seed=0, late_s=0.0):
    """Two cameras; the second one's time needs `clock` to be right, and it is switched on `late_s` after the first."""
    rng = np.random.default_rng(seed)
    t = START + np.arange(round(seconds * RATE)) / RATE
    tables, cameras = {}, {}
    for camera, own in zip(thesis_rig(2), (Clock(), clock), strict=True):
        b = project(camera, path(own.corrected(t) - START)) + rng.normal(0, 0.05, (t.size, 2))
        table = pd.DataFrame({"time_s": t, "target": "t1", "Xf": b[:, 0], "Yf": b[:, 1], "flag": ""})
        tables[camera.name] = table[t >= START + late_s] if camera.name == "cam2" else table
        cameras[camera.name] = (camera, None)
    given = {"cam2": clocks} if isinstance(clocks, str) else clocks
    record = locate(tables, cameras, targets=1, clocks=given, heard={"cam2": heard} if heard else None).record
    return record["clocks"]["cameras"]["cam2"], record["warnings"]


@pytest.mark.parametrize(("begun", "code"), [(0.0, ""), (START + 7200, "12:00:00:00")])
def test_a_camera_that_shares_no_moment_with_the_coded_ones_is_placed_by_the_motion(begun, code):
    rng = np.random.default_rng(1)
    t = START + np.arange(240) / RATE
    tables, cameras = {}, {}
    for camera, late, shown in zip(thesis_rig(2), (0.0, 0.4127), (t, begun + t - START), strict=True):
        b = project(camera, pluck(t + late - START)) + rng.normal(0, 0.05, (t.size, 2))
        own = {"time_s": shown, "timecode": code if late else "10:00:00:00", "target": "t1", "flag": ""}
        tables[camera.name] = pd.DataFrame(own | {"Xf": b[:, 0], "Yf": b[:, 1]})
        cameras[camera.name] = (camera, None)
    run = locate(tables, cameras, targets=1, clocks={"cam2": "motion"})
    assert run.record["clocks"]["cameras"]["cam2"]["offset_s"] == pytest.approx(START + 0.4127 - begun, abs=0.02 / RATE)
    assert run.trajectories["x"].notna().mean() > 0.9


def test_sound_says_which_period_of_a_steady_swing_it_is():
    clock = Clock(1.613)
    alone, warnings = located(steady, Clock(0.813))
    assert any("another offset fits about as well" in line for line in warnings)
    assert alone["ambiguous"]
    own, warnings = located(steady, clock, {"sound": said(1.62)})
    assert own["offset_s"] == pytest.approx(1.613, abs=0.02 / RATE)
    assert own["source"].startswith("motion")
    assert not own["ambiguous"]
    assert not warnings


def test_motion_sharpens_what_sound_found_seconds_away():
    own, warnings = located(pluck, Clock(3.379), {"sound": said(3.385)}, seconds=14)
    assert own["offset_s"] == pytest.approx(3.379, abs=0.02 / RATE)
    assert own["source"].startswith("motion")
    assert own["witnesses"]["sound"]["offset_s"] == pytest.approx(3.385)
    assert not warnings


def test_targets_at_rest_leave_it_to_the_flash():
    own, _ = located(rest, Clock(0.012), {"flash": said(0.0123, 0.001), "sound": said(0.02)})
    assert own["offset_s"] == pytest.approx(0.0123, abs=0.001)
    assert own["source"].startswith("flash")
    assert "motion" not in own["witnesses"]
    nothing, warnings = located(rest, Clock(0.012))
    assert (nothing["source"], nothing["offset_s"]) == ("none", 0.0)
    assert any("cameras.cam2.clock: the motion and the sound and the flash do not estimate it" in w for w in warnings)


def test_a_flash_that_contradicts_the_motion_is_told_with_both_figures():
    own, warnings = located(pluck, Clock(0.012), {"flash": said(0.5, 0.002)})
    assert own["offset_s"] == pytest.approx(0.012, abs=0.02 / RATE)
    assert own["source"] == "motion"
    line = next(line for line in warnings if "contradict" in line)
    assert "the motion (12" in line
    assert "the flash (500 ± 2" in line


def test_sound_that_agrees_is_a_check_and_gives_the_rate():
    clock = Clock(0.012, 50.0)
    own, warnings = located(pluck, clock, {"sound": said(0.013, rate=50.3)})
    assert not warnings
    assert own["source"] == "motion and sound"
    assert own["rate_ppm"] == pytest.approx(50.3, abs=0.2)
    assert own["offset_s"] == pytest.approx(0.012, abs=0.02 / RATE)
    # 160 in between the cameras and more: sound may be off by milliseconds, and is said to
    assert own["witnesses"]["sound"]["offset_s_sd"] > 0.004
    low, high = own["offset_s_95"]
    assert low < 0.012 < high


@pytest.mark.parametrize("who", ["sound", "flash"])
def test_the_config_may_insist_on_one_method(who):
    heard = {who: said(0.02, 0.001)}
    own, _ = located(pluck, Clock(0.012), heard, who)
    assert own["offset_s"] == pytest.approx(0.02)
    assert list(own["witnesses"]) == [who]
    _, warnings = located(pluck, Clock(0.012), None, who)
    assert any(f"cameras.cam2.clock: the {who} does not estimate it, and it is left as it is" in w for w in warnings)
    motion, _ = located(pluck, Clock(0.012), heard, "motion")
    assert motion["source"] == "motion"
    assert motion["offset_s"] == pytest.approx(0.012, abs=0.02 / RATE)


def test_a_reference_whose_own_clock_is_corrected_passes_its_correction_on():
    """Both cameras are 0.1 s late and 20 ppm slow, cam2 12 ms and 30 ppm more; the flash compares raw times."""
    clocks = {"cam1": {"offset_s": 0.1, "rate_ppm": 20.0}, "cam2": "flash"}
    own, _ = located(rest, Clock(0.012), {"flash": said(0.012, rate=30.0, at_s=START - 10)}, clocks)
    assert own["rate_ppm"] == pytest.approx(50.0)
    # 10 s after the flash was timed its offset is 0.3 ms more
    assert own["offset_s"] == pytest.approx(0.112 + 10 * 30e-6, abs=2e-6)


def test_sound_is_doubted_by_what_it_needs_from_camera_to_camera():
    """From any direction: D cos(angle) later, the cosine uniform, so D / sqrt 3 at 343 m/s; D in the world's unit."""
    a, b = thesis_rig(2)
    metres = 0.0254 * float(np.linalg.norm(a.position - b.position))
    own, _ = located(rest, Clock(0.012), {"sound": said(0.012, 1e-6)}, "sound")
    assert own["offset_s_sd"] == pytest.approx(metres / np.sqrt(3) / 343, rel=1e-3)


def test_an_estimate_from_before_midnight_is_no_day_late():
    own, _ = located(rest, Clock(0.012), {"flash": said(0.012, rate=30.0, at_s=START - 10 + 86400)}, "flash")
    assert own["offset_s"] == pytest.approx(0.012 + 10 * 30e-6, abs=1e-6)


def test_a_reference_that_runs_slow_has_lost_time_when_the_other_camera_begins():
    clocks = {"cam1": {"offset_s": 0.0, "rate_ppm": 200.0}, "cam2": "flash"}
    own, _ = located(rest, Clock(), {"flash": said(0.0, at_s=START + 5)}, clocks, late_s=5)
    assert own["offset_s"] == pytest.approx(5 * 200e-6, rel=1e-3)

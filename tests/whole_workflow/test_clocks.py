"""Cameras that nobody locked together, and targets that stand still: only a clap or a lamp tells the clocks."""

import copy
import json
import shutil

import numpy as np
import pytest

from tests.files.clips import NTSC, ball, make_clip
from tests.whole_workflow.conftest import CONFIG, SCENARIO, configure, planned, snakemake
from vidtrack.geometry.camera import project
from vidtrack.simulate.scenario import scenario_from

LATE = 0.012
"""s that must be added to the time of cam2."""
FS, FRAMES, SIZE = 48_000, 80, (512, 480)
PLACE = (5.0, -3.0, 4.0)
CLAP = (0.0, 60.0, 10.0)
"""Where somebody claps, in; microphones sit on the cameras."""
RATE = float(NTSC)


def in_room(rng):
    """What is to be heard at CLAP (s -> amplitude): a quiet room, and two claps that ring for some 20 ms."""
    t = np.arange(-1, FRAMES / RATE + 2, 1 / FS)
    sound = rng.normal(0, 2e-3, t.size)
    for at in (0.81, 2.17):
        sound += np.where(t > at, 0.5 * np.exp(-(t - at) / 0.005), 0) * rng.normal(size=t.size)
    return lambda when: np.interp(when, t, sound)


def metres(camera):
    return float(np.linalg.norm(camera.position - np.array(CLAP))) * 0.0254


def lamp(t):
    """Share of an exposure about t (n,), s, that is lit by a lamp that is switched on, off and on again."""
    on = np.zeros_like(t)
    for moment, step in ((0.7049, 1), (1.5137, -1), (2.4241, 1)):
        on += step * np.clip((t - moment) * RATE + 0.5, 0, 1)
    return on


def film(path, camera, late, sound, light, rng):
    """A ball at rest, filmed at true times that its camera shows `late` s too early; what its microphone hears."""
    Xf, Yf = project(camera, PLACE)
    still = ball(*SIZE, Xf, Yf, radius=7.0)
    lit = 45 * lamp(np.arange(FRAMES) / RATE + late) if light else np.zeros(FRAMES)
    heard = None
    if sound is not None:
        t = np.arange(int(FRAMES / RATE * FS)) / FS
        heard = sound(t + late - metres(camera) / 343.2) + 5e-4 * rng.normal(size=t.size)

    def picture(i):
        return np.clip(np.rint(0.7 * still + lit[i] + rng.normal(0, 2, still.shape)), 0, 255).astype(np.uint8)

    options = {"qmin": "1", "qmax": "2"}
    make_clip(path, "mjpeg", "yuvj420p", n=FRAMES, size=SIZE, picture=picture, sound=heard, options=options)


@pytest.fixture(scope="module")
def still(processed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("clocks") / "lab"
    shutil.copytree(processed, folder, copy_function=shutil.copy2)
    scenario, rng = scenario_from(SCENARIO, "scenario"), np.random.default_rng(11)
    for run, sound, light in (("clap", in_room(rng), False), ("lamp", None, True), ("silent", None, False)):
        (folder / "runs" / run).mkdir()
        for name, late in (("cam1", 0.0), ("cam2", LATE)):
            film(folder / f"runs/{run}/{name}.mov", scenario.camera(name), late, sound, light, rng)
    shutil.rmtree(folder / "runs/still")
    config = copy.deepcopy(CONFIG)
    config["cameras"]["cam2"]["clock"] = "auto"
    configure(folder, config)
    answer = snakemake(folder)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


def clock(folder, run):
    record = json.loads((folder / f"results/runs/{run}/locate.json").read_text())
    return record["clocks"]["cameras"]["cam2"], record["warnings"]


def test_a_clap_tells_the_clock_to_what_sound_needs_between_the_cameras(still):
    """From 160 in apart, sound is up to 12 ms later in one: 6.8 ms, one sd, if it may come from anywhere."""
    own, warnings = clock(still, "clap")
    assert own["source"] == "sound"
    cameras = [scenario_from(SCENARIO, "scenario").camera(name) for name in ("cam1", "cam2")]
    earlier = (metres(cameras[0]) - metres(cameras[1])) / 343.2
    assert abs(earlier) > 0.002  # or the test would not see it
    assert own["offset_s"] == pytest.approx(LATE + earlier, abs=2e-4)
    assert own["offset_s_sd"] == pytest.approx(0.0068, abs=0.0003)
    assert abs(own["offset_s"] - LATE) < 2 * own["offset_s_sd"]
    assert any("known to 6.8" in line for line in warnings)


def test_a_lamp_tells_the_clock_to_a_part_of_a_picture(still):
    own, _ = clock(still, "lamp")
    assert own["source"] == "flash"
    assert own["offset_s"] * RATE == pytest.approx(LATE * RATE, abs=0.02)
    assert 0.01 < own["offset_s_sd"] * RATE < 0.1  # three changes do not tell how long the shutter was open


def test_where_nothing_tells_the_clock_is_left_and_that_is_said(still):
    own, warnings = clock(still, "silent")
    assert (own["source"], own["offset_s"]) == ("none", 0.0)
    assert any("the motion and the sound and the flash do not estimate it" in line for line in warnings)


def test_motion_tells_best_and_needs_no_help(still):
    own, _ = clock(still, "pluck")
    assert own["source"] == "motion"
    assert abs(own["offset_s"]) * RATE < 0.02


PAGES = {"verdict": 1, "report": 1, "report_run": 4}


def test_the_report_says_which_method_estimated_the_clock(still):
    for run, method in (("lamp", "flash"), ("clap", "sound")):
        assert f"estimated from the {method}" in (still / f"results/report/run_{run}.html").read_text()


def test_a_clock_given_in_the_config_asks_nobody_and_decodes_nothing(still, tmp_path):
    folder = tmp_path / "lab"
    shutil.copytree(still, folder, copy_function=shutil.copy2)
    assert planned(folder) == {}
    config = copy.deepcopy(CONFIG)
    config["cameras"]["cam2"]["clock"] = {"offset_s": 0.012}
    configure(folder, config)
    assert planned(folder) == {"locate": 4, "kinematics": 4, "compare": 1, **PAGES}
    config["cameras"]["cam2"]["clock"] = "flash"
    configure(folder, config)
    assert planned(folder) == {"clocks": 4, "locate": 4, "kinematics": 4, "compare": 1, **PAGES}

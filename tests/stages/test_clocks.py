"""What sound and light tell of clocks, with the sign that the config's clock has."""

import json

import numpy as np
import pandas as pd
import pytest

from vidtrack.files.records import plain
from vidtrack.stages.clocks import clocks, heard_cameras
from vidtrack.timing.clock import Clock

HZ = 8000
SECONDS = 12.0
RATE = 30.0


def recorded(clock, start, seed, *, lamp=(2.0137, 5.4321, 8.8888), seconds=SECONDS):
    """A camera's light and sound: its time needs `clock` to be right; it begins at `start` s of its own time.

    The room hums, and a lamp is switched on and off, at true times that all cameras share.
    """
    t = start + np.arange(int(seconds * RATE)) / RATE
    true = clock.corrected(t)
    light = np.full(t.size, 60.0)
    for k, moment in enumerate(lamp):
        light += 50 * (-1) ** k * np.clip((true - moment) * RATE + 0.5, 0, 1)
    own = np.random.default_rng(seed)
    table = pd.DataFrame({"middle_s": t, "brightness": light + own.normal(0, 0.02, t.size)})
    room = np.random.default_rng(99).normal(size=int(60 * HZ))
    at = start + np.arange(int(seconds * HZ)) / HZ
    heard = np.interp(clock.corrected(at) * HZ, np.arange(room.size) - 20 * HZ, room)
    return table, (start, heard + 0.3 * own.normal(size=at.size))


def told(cameras, sought, references=("cam1",)):
    light = {name: table for name, (table, _) in cameras.items()}
    sounds = {name: sound for name, (_, sound) in cameras.items() if sound is not None}
    return clocks(light, sounds, rate_hz=HZ, references=references, sought=sought)


@pytest.mark.parametrize("method", ["sound", "flash"])
@pytest.mark.parametrize("clock", [Clock(-0.012), Clock(0.37 / RATE), Clock(0.0)])
def test_the_clock_found_is_the_one_that_must_be_added(method, clock):
    cameras = {"cam1": recorded(Clock(), 0.0, 1), "cam2": recorded(clock, 0.25, 2)}
    own = told(cameras, {"cam2": [method]})["cam2"][method]
    assert own["reference"] == "cam1"
    assert own["offset_s"] * RATE == pytest.approx(clock.offset_s * RATE, abs=0.02)
    assert own["n"] >= 3
    assert json.loads(json.dumps(plain(own)))["covariance"][0][0] == pytest.approx(own["offset_s_sd"] ** 2)


def test_time_code_that_passed_midnight_is_brought_to_one_day():
    (table, sound), clock = recorded(Clock(0.01), 0.0, 3), 86400.0
    late = table.assign(middle_s=table["middle_s"] + clock), (sound[0] + clock, sound[1])
    own = told({"cam1": recorded(Clock(), 0.0, 1), "cam2": late}, {"cam2": ["sound", "flash"]})["cam2"]
    assert [own[w]["offset_s"] for w in ("sound", "flash")] == pytest.approx([0.01, 0.01], abs=0.001)


def test_the_first_reference_that_has_something_in_common_is_the_one():
    silent = (recorded(Clock(), 0.0, 1, lamp=())[0], None)
    cameras = {"cam1": silent, "cam2": recorded(Clock(), 0.0, 2), "cam3": recorded(Clock(0.01), 0.0, 3)}
    own = told(cameras, {"cam3": ["sound", "flash"]}, ("cam1", "cam2"))["cam3"]
    assert own["sound"]["reference"] == own["flash"]["reference"] == "cam2"


def test_one_change_that_lies_seconds_apart_is_not_one_event():
    cameras = {"cam1": recorded(Clock(), 0.0, 1, lamp=(2.0,)), "cam2": recorded(Clock(), 0.0, 2, lamp=(6.0,))}
    assert "offset_s" not in told(cameras, {"cam2": ["flash"]})["cam2"]["flash"]


def test_only_wanted_clocks_are_estimated_and_nothing_in_common_gives_no_estimate():
    cameras = {"cam1": recorded(Clock(), 0.0, 1, lamp=()), "cam2": recorded(Clock(), 0.0, 2, lamp=())}
    cameras["cam2"] = cameras["cam2"][0], (0.0, np.random.default_rng(5).normal(size=HZ * 12))
    own = told(cameras, {"cam2": ["sound", "flash"]})["cam2"]
    assert set(own) == {"sound", "flash"}
    assert "offset_s" not in own["sound"]
    assert own["flash"] == {"n": 0, "of": 0}
    assert told(cameras, {}) == {}


def test_cameras_of_different_rates_saw_the_lamp_in_exposures_of_different_length():
    """50 pictures a second and 25: a picture's middle is 10 ms, and 20 ms, after its exposure began."""
    cameras = {}
    for name, rate in (("cam1", 50.0), ("cam2", 25.0)):
        t = np.arange(int(SECONDS * rate)) / rate
        light = 60.0 + sum(
            50 * (-1) ** k * np.clip((t - m) * rate + 0.5, 0, 1) for k, m in enumerate((2.013, 5.432, 8.8))
        )
        noise = np.random.default_rng(5).normal(0, 0.02, t.size)
        cameras[name] = (pd.DataFrame({"middle_s": t, "brightness": light + noise}), None)
    own = told(cameras, {"cam2": ["flash"]})["cam2"]["flash"]
    assert own["offset_s"] == pytest.approx(0.0, abs=0.0005)


def test_sound_is_needed_of_the_references_and_of_cameras_whose_clock_is_sought_in_it():
    cameras = ["cam1", "cam2", "cam3"]
    assert heard_cameras(cameras, ["cam1"], {"cam2": ["flash"], "cam3": ["sound", "flash"]}) == ["cam1", "cam3"]
    assert heard_cameras(cameras, ["cam1"], {"cam2": ["flash"]}) == []

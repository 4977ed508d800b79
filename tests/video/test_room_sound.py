"""What the microphones heard, on the cameras' own time."""

from fractions import Fraction

import numpy as np
import pytest

from tests.files.clips import NTSC, make_clip
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.timing.timecode import parse
from vidtrack.video.reader import open_video
from vidtrack.video.room_sound import RATE_HZ, room_sound

FS = 48_000
CLAP = 1.2345


def clap(seconds=3.0, at=CLAP, fs=FS):
    """A click at `at` s."""
    samples = np.zeros(int(seconds * fs))
    samples[round(at * fs)] = 0.9
    return samples


def code(seconds=3.0):
    return ltc_signal(np.arange(int(seconds * FS)) / FS, parse("10:00:00;00", NTSC), level=0.4)


def heard(path, speed=1.0, later=0.0):
    """The sound of a recording whose camera's time runs from `later`, `speed` times as fast as its stamps."""
    with open_video(str(path)) as video:
        start = video.info.start
        stamps = np.array([float(frame.time) for frame in video.frames()])
    return room_sound(str(path), start, stamps, later + speed * stamps)


def loudest(sound):
    return sound.start + np.abs(sound.samples).argmax() / RATE_HZ


def clip(path, sound, **how):
    return make_clip(path, "mjpeg", "yuvj420p", n=80, size=(64, 48), sound=sound, **how)


@pytest.mark.parametrize("fs", [48_000, 44_100, 8000, 11_025])
def test_a_clap_stands_where_the_cameras_time_has_it_whatever_the_sampling(tmp_path, fs):
    sound = heard(clip(tmp_path / "a.mov", clap(fs=fs), sound_rate=fs), later=36000.0)
    assert loudest(sound) == pytest.approx(36000 + CLAP, abs=0.6 / RATE_HZ + 0.6 / fs)
    assert sound.samples.sum() * fs / RATE_HZ == pytest.approx(0.9, abs=0.02)  # averaged, not picked
    assert len(sound.samples) == pytest.approx(3 * RATE_HZ, abs=2)


def test_a_track_that_begins_late_and_a_tape_that_ran_fast_are_put_right(tmp_path):
    late = clip(tmp_path / "a.mkv", clap(), sound_start=7000)
    assert loudest(heard(late)) == pytest.approx(CLAP + 7000 / FS, abs=1.5e-3)  # Matroska rounds to 1 ms
    assert loudest(heard(late, speed=0.5)) == pytest.approx((CLAP + 7000 / FS) / 2, abs=1e-3)


def test_time_code_is_no_sound_but_the_channel_beside_it_is(tmp_path):
    alone = heard(clip(tmp_path / "a.mov", code()))
    assert (alone.samples.size, alone.note) == (0, "time code alone")
    beside = heard(clip(tmp_path / "b.mov", np.stack([code(), clap()])))
    assert loudest(beside) == pytest.approx(CLAP, abs=1 / RATE_HZ)
    assert np.abs(beside.samples).max() > 20 * np.abs(beside.samples).std()  # nothing of the code is left in it
    both = heard(clip(tmp_path / "c.mov", np.stack([clap(), clap(at=2.0)])))
    assert both.note == "track 1, mean of 2 channels"


def test_no_sound_and_a_time_that_jumps_are_told(tmp_path):
    assert heard(make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=4)).note == "no sound"
    path = str(clip(tmp_path / "b.mov", clap()))
    stamps = np.arange(80) / 29.97
    jumped = stamps + np.where(stamps > 1, 3600.0, 0.0)
    assert room_sound(path, 0, stamps, jumped).note == "its time code jumps"
    assert room_sound(path, 0, stamps, stamps - 2 * (jumped - stamps)).note == "its time code jumps back"


def test_the_sound_of_slow_motion_is_not_used():
    found = room_sound("not opened", Fraction(0), np.arange(3.0), np.arange(3.0), pace=0.25)
    assert found.samples.size == 0
    assert found.note == "not used: the rate of the pictures was given"

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.files.clips import NTSC, make_clip
from vidtrack.errors import VidtrackError
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.timing.timecode import parse
from vidtrack.video.reader import open_video
from vidtrack.video.times.time_source import TimeSource, find_time

FS = 48_000
TEN = parse("10:00:00;00", NTSC)


def code_sound(seconds: float, start: float = 0.0, noise: float = 0.1, speed: float = 1.0, first=TEN) -> np.ndarray:
    """Time code whose word `first` begins `start` s after the first picture, in 9 dB of noise and so."""
    t = np.arange(int(seconds * FS)) / FS
    signal = ltc_signal(t, first, start=start, level=0.35, speed=speed)
    return signal + np.random.default_rng(0).normal(0, noise, t.shape)


def clock_of(path: Path, **how) -> tuple[TimeSource, np.ndarray]:
    """What was found, and the time stamps of all frames."""
    with open_video(str(path)) as video:
        times = np.array([float(frame.time) for frame in video.frames()])
        return find_time(str(path), video.info, **how), times


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "sound_codec"),
    [
        ("a.mov", "mjpeg", "yuvj420p", "pcm_s16le"),
        ("a.mkv", "ffv1", "gray", "pcm_s16le"),
        ("a.avi", "mjpeg", "yuvj420p", "pcm_s16le"),
        ("a.mp4", "libx264", "yuv420p", "aac"),
        ("a.mpg", "mpeg2video", "yuv420p", "mp2"),
    ],
)
@pytest.mark.parametrize("start", [0.0, 0.0123, -0.0101])
def test_longitudinal_code_places_frames_to_a_hundredth_of_a_frame(tmp_path, name, codec, pix_fmt, sound_codec, start):
    path = make_clip(
        tmp_path / name, codec, pix_fmt, n=120, size=(64, 48), sound=code_sound(4, start), sound_codec=sound_codec
    )
    found, times = clock_of(path)
    assert found.base.source == "ltc"
    true = float(TEN.seconds) + np.arange(120) / float(NTSC) - start
    off = (found.base.fitted(times).seconds(times) - true) * float(NTSC)
    assert np.abs(off).max() < 0.01
    assert found.base.labels(times)[29] == "10:00:00;29"


def test_sound_that_begins_after_the_picture_is_placed_by_its_stamps(tmp_path):
    sound = code_sound(3, -7000 / FS)  # sample 0 comes 7000 samples after the picture, and so does its code
    path = make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=90, size=(64, 48), sound=sound, sound_start=7000)
    found, times = clock_of(path)
    np.testing.assert_allclose(found.base.seconds(times)[0], float(TEN.seconds), atol=0.01 / 29.97)


def test_the_code_may_be_on_the_second_channel(tmp_path):
    speech = np.random.default_rng(2).normal(0, 0.2, 3 * FS)
    path = make_clip(
        tmp_path / "a.mov", "mjpeg", "yuvj420p", n=80, size=(64, 48), sound=np.stack([speech, code_sound(3)])
    )
    assert clock_of(path)[0].base.source == "ltc"


def test_a_tape_digitised_at_half_speed_runs_at_the_speed_of_its_code(tmp_path):
    path = make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=120, size=(64, 48), sound=code_sound(4, speed=0.5))
    found, times = clock_of(path)
    seconds = found.base.seconds(times) - float(TEN.seconds)
    np.testing.assert_allclose(seconds, times / 2, atol=0.01 / 29.97)
    assert "0.500 of its speed" in found.table[0].note


def test_a_tape_whose_speed_wanders_is_followed(tmp_path):
    t = np.arange(20 * FS) / FS
    played = t + 0.05 * np.sin(t / 2)  # +-2.5 %
    sound = ltc_signal(played, TEN, level=0.4)
    path = make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=590, size=(64, 48), sound=sound)
    found, times = clock_of(path)
    off = found.base.seconds(times) - float(TEN.seconds) - (times + 0.05 * np.sin(times / 2))
    assert np.abs(off * float(NTSC)).max() < 0.06


def test_a_dropout_is_bridged_and_told_and_a_jump_makes_the_clock_jump(tmp_path):
    sound = code_sound(8, noise=0.01)
    sound[2 * FS : int(2.5 * FS)] = 0
    sound[5 * FS :] = code_sound(8, 5.0, 0.01, first=parse("11:00:00;00", NTSC))[5 * FS :]
    path = make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=230, size=(64, 48), sound=sound)
    found, times = clock_of(path)
    labels = found.base.labels(times)
    assert labels[74] == "10:00:02;14"  # in the dropout
    assert labels[148] == "10:00:04;28"
    assert labels[155] == "11:00:00;05"
    assert "dropouts, bridged" in found.table[0].note
    assert "jumps 1 times" in found.table[0].note


def test_the_table_says_which_source_is_used_and_how_far_the_others_are_off(tmp_path):
    path = make_clip(
        tmp_path / "a.mov", "mjpeg", "yuvj420p", n=90, size=(64, 48), sound=code_sound(3), timecode="10:00:05;00"
    )
    found, _ = clock_of(path, start_timecode="10:00:00;00")
    rows = {row.source: row for row in found.table}
    assert list(rows) == ["ltc", "tmcd", "config"]
    assert [row.used for row in found.table] == [True, False, False]
    assert rows["tmcd"].label == "10:00:05;00"
    assert rows["tmcd"].off == pytest.approx(5.005, abs=0.001)
    assert rows["config"].off == pytest.approx(0, abs=0.001)
    assert len(found.problems) == 1
    assert "tmcd says 10:00:05;00" in found.problems[0]


def test_the_start_in_the_config_is_the_last_resort(tmp_path):
    plain = make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=4, size=(64, 48))
    found, times = clock_of(plain, start_timecode="10:00:59.15")
    assert found.base.source == "config"
    assert found.base.labels(times)[0] == "10:00:59:15"
    labelled = make_clip(tmp_path / "b.mkv", "ffv1", "gray", n=4, size=(64, 48), timecode="10:00:00:00")
    assert clock_of(labelled, start_timecode="10:00:59.15")[0].base.source == "matroska"
    unset = make_clip(tmp_path / "c.mkv", "ffv1", "gray", n=4, size=(64, 48), timecode="00:00:00:00")
    found, _ = clock_of(unset, start_timecode="10:00:59.15")
    assert found.base.source == "config"
    assert found.problems == ()
    assert "it was never set" in {row.source: row for row in found.table}["matroska"].note


def test_without_any_source_time_counts_from_the_first_frame(tmp_path):
    found, times = clock_of(make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=4, size=(64, 48)))
    assert found.base.source == "none"
    assert found.table == ()
    assert found.base.seconds(times)[0] == 0


def test_a_start_that_is_no_time_code_is_named(tmp_path):
    path = make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=4, size=(64, 48))
    with pytest.raises(VidtrackError, match="start_timecode: 'ten hours' is not a time code"):
        clock_of(path, start_timecode="ten hours")


def test_a_label_that_cannot_be_is_told_and_not_used(tmp_path):
    path = make_clip(tmp_path / "a.mkv", "ffv1", "gray", n=4, size=(64, 48))
    with open_video(str(path)) as video:
        info = replace(video.info, timecodes={"matroska": "10:00:00:99"})
    found = find_time(str(path), info)
    assert found.base.source == "none"
    assert "cannot be used" in found.problems[0]


def spliced_tape(folder: Path) -> Path:
    """Raw DV of two takes: the recorder was paused between them, and its code jumped."""
    takes = [
        make_clip(folder / f"{k}.dv", "dvvideo", "yuv411p", n=8, size=(720, 480), timecode=label).read_bytes()
        for k, label in enumerate(["01:00:00;10", "01:07:00;20"])
    ]
    (folder / "tape.dv").write_bytes(b"".join(takes))
    return folder / "tape.dv"


def test_where_the_code_of_a_tape_jumps_the_clock_jumps(tmp_path):
    found, times = clock_of(spliced_tape(tmp_path))
    labels = found.base.labels(times).tolist()
    assert labels[:2] + labels[7:10] == ["01:00:00;10", "01:00:00;11", "01:00:00;17", "01:07:00;20", "01:07:00;21"]
    assert "jumps 1 times (to 01:07:00;20 at 0.27 s)" in found.table[0].note


def test_one_spoilt_code_on_a_tape_is_no_jump(tmp_path):
    path = make_clip(tmp_path / "a.dv", "dvvideo", "yuv411p", n=8, size=(720, 480), timecode="01:00:00;10")
    data = bytearray(path.read_bytes())
    data[3 * 120_000 + 88] = 0x33  # the seconds of frame 3
    path.write_bytes(data)
    found, times = clock_of(path)
    assert found.base.labels(times)[[3, 4]].tolist() == ["01:00:00;13", "01:00:00;14"]
    assert "unbroken" in found.table[0].note


@pytest.mark.parametrize("name", ["tape.avi", "tape.mov"])
def test_dv_in_avi_and_mov_has_the_codes_of_its_frames_too(tmp_path, name):
    path = make_clip(tmp_path / name, "dvvideo", "yuv411p", n=10, size=(720, 480))
    with av.open(str(path)) as container:
        places = [packet.pos for packet in container.demux(video=0) if packet.size]
    data = bytearray(path.read_bytes())
    for k, place in enumerate(places):
        frame = 0x10 + k if k < 6 else 0x20 + k - 6  # binary-coded decimal, with the drop-frame flag
        data[place + 86 : place + 91] = bytes([0x13, frame | 0x40, 0x30, 0x59, 0x09])
    path.write_bytes(data)
    found, times = clock_of(path)
    assert found.base.source == "dv"
    assert found.base.labels(times)[[0, 5, 6, 9]].tolist() == [f"09:59:30;{frame}" for frame in (10, 15, 20, 23)]


def test_a_still_picture_has_no_time(tmp_path):
    path = make_clip(tmp_path / "a.png", "png", "gray", n=1, muxer="image2")
    found, _ = clock_of(path, start_timecode="10:00:00:00")
    assert found.base.source == "none"


def test_in_five_minutes_of_matroska_with_its_rounded_stamps_no_frame_is_off(tmp_path):
    from vidtrack.timing.timebase import TimeBase

    base = TimeBase(NTSC, NTSC)
    times = np.round(np.arange(9000) / float(NTSC), 3)
    exact = np.arange(9000) * Fraction(1001, 30000)
    np.testing.assert_allclose(base.fitted(times).seconds(times), exact.astype(float), atol=1e-9)

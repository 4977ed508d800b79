"""What is on a tape: the grey levels, the time code, the fields' order, the gaps, the sound."""

from fractions import Fraction

import av
import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.simulate.plan import plan_from
from vidtrack.simulate.tape import Sound, Tape, write_tape
from vidtrack.timing.timecode import parse

RATE = Fraction(30000, 1001)


def pictures(n=5, size=(96, 64), dtype=np.uint8, top=256):
    rng = np.random.default_rng(4)
    return [rng.integers(0, top, size[::-1]).astype(dtype) for _ in range(n)]


def played(path):
    with av.open(path) as container:
        stream = container.streams.video[0]
        frames = []
        for frame in container.decode(video=0):
            plane = frame.planes[0]
            kind = np.uint16 if "16" in frame.format.name or "10" in frame.format.name else np.uint8
            rows = np.frombuffer(plane, kind).reshape(frame.height, -1)[:, : frame.width]
            frames.append((frame.time, rows.copy()))
        return stream, frames


def test_a_lossless_tape_gives_back_every_grey_level(tmp_path):
    path = str(tmp_path / "a.mkv")
    write_tape(path, pictures(), Tape(codec="ffv1", container="mkv"), rate=RATE)
    _, frames = played(path)
    assert all((got == put).all() for (_, got), put in zip(frames, pictures(), strict=True))


def test_ten_bits_go_in_and_come_out(tmp_path):
    path = str(tmp_path / "a.mkv")
    deep = pictures(2, dtype=np.uint16, top=1024)
    write_tape(path, deep, Tape(codec="ffv1", container="mkv"), rate=RATE, bits=10)
    assert all((got == put).all() for (_, got), put in zip(played(path)[1], deep, strict=True))


@pytest.mark.parametrize(
    ("codec", "container", "size"),
    [
        ("mjpeg", "mov", (96, 64)),
        ("mjpeg", "avi", (96, 64)),
        ("h264", "mp4", (96, 64)),
        ("mpeg2", "mov", (96, 64)),
        ("dv", "dv", (720, 480)),
        ("png", "png", (96, 64)),
    ],
)
def test_every_codec_shows_a_soft_picture_nearly_as_it_was(tmp_path, codec, container, size):
    path = str(tmp_path / f"a.{container}")
    across = np.linspace(30, 220, size[0])
    soft = np.broadcast_to(across, size[::-1]).astype(np.uint8)
    count = 1 if codec == "png" else 3
    write_tape(path, [soft] * count, Tape(codec=codec, container=container), rate=RATE)
    frames = played(path)[1]
    assert len(frames) == count
    assert np.abs(frames[0][1].astype(float) - soft).mean() < 2.5


@pytest.mark.parametrize("code", ["10:00:54;12", "23:59:58:29"])
@pytest.mark.parametrize("container", ["mov", "mkv"])
def test_the_time_code_can_be_read_from_the_file(tmp_path, code, container):
    path = str(tmp_path / f"a.{container}")
    codec = "mjpeg" if container == "mov" else "ffv1"
    write_tape(path, pictures(), Tape(codec=codec, container=container), rate=RATE, start=parse(code, RATE))
    stream, _ = played(path)
    found = {key.lower(): value for key, value in stream.metadata.items()}
    assert found["timecode"] == code


def test_a_size_that_a_codec_does_not_have_is_refused_in_one_line(tmp_path):
    with pytest.raises(VidtrackError, match=r"the codec dv does not take this size.*Change them"):
        write_tape(str(tmp_path / "a.avi"), pictures(), Tape(codec="dv", container="avi"), rate=RATE)
    assert list(tmp_path.iterdir()) == []


def test_a_tape_without_time_code_has_none(tmp_path):
    path = str(tmp_path / "a.mov")
    write_tape(path, pictures(), Tape(timecode="none"), rate=RATE, start=parse("10:00:00:00", RATE))
    assert "timecode" not in played(path)[0].metadata


def test_a_lost_frame_leaves_a_gap_in_time(tmp_path):
    path = str(tmp_path / "a.mov")
    write_tape(path, pictures(6), Tape(), rate=RATE, lost={2, 3})
    at = [round(time * float(RATE)) for time, _ in played(path)[1]]
    assert at == [0, 1, 4, 5]


@pytest.mark.parametrize(("order", "flag"), [("none", {0, 1}), ("top", {2, 5}), ("bottom", {3, 4})])
def test_the_file_says_which_field_comes_first(tmp_path, order, flag):
    path = str(tmp_path / "a.mov")
    write_tape(path, pictures(), Tape(), rate=RATE, interlace=order)
    with av.open(path) as container:
        next(container.decode(video=0))
        assert container.streams.video[0].codec_context.field_order in flag


def test_sound_is_kept_sample_by_sample(tmp_path):
    path = str(tmp_path / "a.mov")
    samples = (1e4 * np.sin(np.arange(10_000) / 9)).astype(np.int16)
    write_tape(path, pictures(), Tape(), rate=RATE, sound=Sound(samples=samples, rate=48000))
    with av.open(path) as container:
        got = np.concatenate([frame.to_ndarray()[0] for frame in container.decode(audio=0)])
    assert (got == samples).all()


@pytest.mark.parametrize(("codec", "container"), [("mjpeg", "mov"), ("ffv1", "mkv"), ("h264", "mp4"), ("mpeg2", "mov")])
def test_the_same_pictures_make_the_same_bytes(tmp_path, codec, container):
    content = []
    for name in ("a", "b"):
        path = tmp_path / f"{name}.{container}"
        write_tape(
            str(path), pictures(), Tape(codec=codec, container=container), rate=RATE, start=parse("1:02:03:04", RATE)
        )
        content.append(path.read_bytes())
    assert content[0] == content[1]


def test_a_recording_that_breaks_off_leaves_nothing_behind(tmp_path):
    def broken():
        yield pictures(1)[0]
        raise RuntimeError("the power fails")

    with pytest.raises(RuntimeError):
        write_tape(str(tmp_path / "a.mov"), broken(), Tape(), rate=RATE)
    assert not list(tmp_path.iterdir())


def test_a_still_that_is_no_png_is_refused():
    with pytest.raises(VidtrackError, match="png"):
        plan_from(Tape, {"codec": "png"}, "x.yaml")


def test_a_tape_that_cannot_hold_sound_as_it_is_refuses_longitudinal_time_code():
    with pytest.raises(VidtrackError, match="mov, mkv or avi"):
        plan_from(Tape, {"codec": "h264", "container": "mp4", "timecode": "ltc"}, "x.yaml")

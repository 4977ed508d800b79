import re
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.files.clips import NTSC, make_clip
from vidtrack.video.reader import open_video
from vidtrack.video.times.embedded_timecode import code_of_dv


def codes(path: Path) -> tuple[dict[str, str], str, str]:
    with open_video(str(path)) as video:
        return video.info.timecodes, video.info.time.source, str(video.info.time.labels(0.0))


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "source", "label"),
    [
        ("a.mov", "mjpeg", "yuvj420p", "tmcd", "10:00:00;15"),
        ("a.mp4", "libx264", "yuv420p", "tmcd", "10:00:00:15"),
        ("a.mkv", "ffv1", "gray", "matroska", "10:00:00;15"),
        ("a.avi", "ffv1", "gray", "ismp", "10:00:00;15"),
        ("a.mxf", "mpeg2video", "yuv422p", "mxf", "10:00:00;15"),
    ],
)
def test_the_label_of_every_container_is_found(tmp_path, name, codec, pix_fmt, source, label):
    path = make_clip(tmp_path / name, codec, pix_fmt, n=3, timecode=label)
    found, used, first = codes(path)
    assert found[source] == label
    assert used == source
    assert first == label


def test_the_group_header_of_mpeg_2_is_read(tmp_path):
    path = make_clip(
        tmp_path / "a.mpg", "mpeg2video", "yuv420p", n=3, options={"gop_timecode": "01:02:03;04", "bf": "0"}
    )
    found, used, first = codes(path)
    assert found == {"gop": "01:02:03;04"}
    assert (used, first) == ("gop", "01:02:03;04")


def test_a_group_header_that_counts_from_zero_is_no_time_code(tmp_path):
    found, used, first = codes(make_clip(tmp_path / "a.mpg", "mpeg2video", "yuv420p", n=3))
    assert found["gop"].startswith("00:00:00")
    assert (used, first) == ("none", "")


def test_every_dv_frame_has_its_own_label(tmp_path):
    path = make_clip(tmp_path / "a.dv", "dvvideo", "yuv411p", n=4, size=(720, 480), timecode="01:59:59;28")
    with open_video(str(path)) as video:
        assert video.info.timecodes["dv"] == "01:59:59;28"
        labels = [frame.timecode for frame in video.frames()]
    assert labels == ["01:59:59;28", "01:59:59;29", "02:00:00;00", "02:00:00;01"]


def test_a_dv_pack_is_binary_coded_decimal_with_frames_first():
    assert code_of_dv(bytes([0x13, 0x29 | 0x40, 0x58, 0x47, 0x21])) == "21:47:58;29"
    assert code_of_dv(bytes([0x13, 0x09, 0x58, 0x47, 0x21])) == "21:47:58:09"


@pytest.mark.parametrize("pack", [b"\xff\xff\xff\xff\xff", b"\x13\xff\xff\xff\xff", b"\x62\x00\x00\x00\x00", b"\x13"])
def test_an_empty_dv_pack_has_no_label(pack):
    assert code_of_dv(pack) is None


def test_a_dv_pack_of_noise_never_makes_an_impossible_label():
    rng = np.random.default_rng(0)
    for pack in rng.integers(0, 256, (500, 4), dtype=np.uint8):
        label = code_of_dv(b"\x13" + pack.tobytes())
        if label is not None:
            h, m, s, f = (int(part) for part in label.replace(";", ":").split(":"))
            assert h < 24
            assert m < 60
            assert s < 60
            assert f < 30


def test_ismp_in_the_header_list_is_found_where_no_library_looks(tmp_path):
    path = make_clip(tmp_path / "a.avi", "mjpeg", "yuvj420p", n=3)
    data = path.read_bytes()
    at = data.index(b"JUNK")  # the muxer leaves room inside the header list: put the chunk there
    size = int.from_bytes(data[at + 4 : at + 8], "little")
    chunk = b"ISMP" + (12).to_bytes(4, "little") + b"10:11:12:13\0"
    junk = b"JUNK" + (size - len(chunk)).to_bytes(4, "little")
    patched = data[:at] + chunk + junk + bytes(size - len(chunk)) + data[at + 8 + size :]
    assert len(patched) == len(data)
    path.write_bytes(patched)
    found, used, first = codes(path)
    assert found == {"ismp": "10:11:12:13"}
    assert (used, first) == ("ismp", "10:11:12:13")


def test_a_label_that_nobody_set_yields_to_one_that_somebody_did(tmp_path):
    path = make_clip(
        tmp_path / "a.mxf",
        "mpeg2video",
        "yuv422p",
        n=3,
        timecode="00:00:00:00",
        options={"gop_timecode": "01:02:03:04", "bf": "0"},
    )
    assert codes(path)[1] == "gop"


def tmcd_counted_at(path: Path, base: Fraction, count: int) -> None:
    """Rewrite a MOV's time code track: so many labels a second, and so many of them since midnight."""
    data = path.read_bytes()
    at = next(m.start() for m in re.finditer(rb"tmcd\x00{7}\x01", data)) + 20
    scale, duration = base.as_integer_ratio()
    entry = scale.to_bytes(4) + duration.to_bytes(4) + bytes([round(base)])
    with av.open(str(path)) as container:
        place = next(container.demux(container.streams.data[0])).pos
    data = data[:at] + entry + data[at + 9 :]
    path.write_bytes(data[:place] + count.to_bytes(4) + data[place + 4 :])


@pytest.mark.parametrize("name", ["a.mov", "a.mp4"])
@pytest.mark.parametrize(("rate", "base"), [(50, 25), (Fraction(60000, 1001), Fraction(30000, 1001)), (100, 50)])
def test_code_counted_at_half_the_rate_of_the_video_is_read_by_its_own_base(tmp_path, name, rate, base):
    rate, base = Fraction(rate), Fraction(base)
    path = make_clip(tmp_path / name, "mjpeg", "yuvj420p", n=6, rate=rate, timecode="10:00:00:00")
    tmcd_counted_at(path, base, 36000 * round(base) + 12)
    with open_video(str(path)) as video:
        time = video.info.time
        times = np.array([float(frame.time) for frame in video.frames()])
    assert (time.rate, time.code_rate) == (rate, base)
    assert time.seconds(0.0) == pytest.approx(36000 + 12 / round(base), abs=1e-6)
    assert time.labels(times)[:5].tolist() == [f"10:00:00:{n}" for n in (12, 12, 13, 13, 14)]


@pytest.mark.parametrize("name", [b"VideoHandler   ", b"\x0eGoPro TCD     ", b"TimeCodeHandler"])
def test_the_name_of_the_handler_of_a_time_code_is_no_rate(tmp_path, name):
    path = make_clip(tmp_path / "a.mp4", "mjpeg", "yuvj420p", n=3, rate=Fraction(30), timecode="10:00:00:12")
    data = path.read_bytes()
    assert data.count(b"TimeCodeHandler") == 1
    path.write_bytes(data.replace(b"TimeCodeHandler", name))
    with open_video(str(path)) as video:
        assert video.info.code_bases == {"tmcd": 30}
        assert video.info.time.seconds(0.0) == pytest.approx(36000.4, abs=1e-6)


def test_an_mxf_says_how_its_code_counts(tmp_path):
    path = make_clip(tmp_path / "a.mxf", "mpeg2video", "yuv422p", n=3, rate=Fraction(25), timecode="10:00:00:12")
    with open_video(str(path)) as video:
        assert video.info.code_bases == {"mxf": 25}


@pytest.mark.parametrize("lost", [0.05, 0.1, 0.3])
def test_frames_that_were_dropped_do_not_change_how_the_code_counts(tmp_path, lost):
    """The average rate is then 28.5 to 21 Hz: counted by that, 10:00:00:00 became 35485.7 s."""
    rng = np.random.default_rng(5)
    stamps = [0, *(np.flatnonzero(rng.random(200) > lost) + 1).tolist()]
    path = make_clip(
        tmp_path / "a.mov",
        "libx264",
        "yuv420p",
        n=len(stamps),
        size=(64, 48),
        stamps=stamps,
        stamp_base=1 / NTSC,
        timecode="10:00:00;00",
        options={"bf": "0"},
    )
    with open_video(str(path)) as video:
        times = np.array([float(frame.time) for frame in video.frames()])
        base = video.info.time.fitted(times)
    assert base.rate == base.code_rate == NTSC
    np.testing.assert_allclose(base.seconds(times), 36000 - 0.036 + np.array(stamps) / float(NTSC), atol=1e-6)
    assert video.account.lost == 200 - (len(stamps) - 1) - (200 - stamps[-1])

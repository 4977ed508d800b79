from fractions import Fraction

import av
import numpy as np
import pytest

from tests.files.clips import make_clip
from vidtrack.video.coded.bitstream import Bitstream

X264 = {"g": "24", "sc_threshold": "0", "bf": "3"}
CLIPS = {
    "none.mp4": ("libx264", X264 | {"x264-params": "b-pyramid=none:b-adapt=0"}),
    "pyramid.mp4": ("libx264", X264 | {"x264-params": "b-pyramid=normal:b-adapt=0"}),
    "pyramid.ts": ("libx264", X264 | {"x264-params": "b-pyramid=normal:b-adapt=0"}),
    "slices.mov": ("libx264", X264 | {"x264-params": "slices=3"}),
    "hevc.mp4": ("libx265", {"x265-params": "log-level=none:bframes=3:b-adapt=0:pools=1"}),
    "mpeg2.mpg": ("mpeg2video", {"bf": "2"}),
}


def packets(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        bitstream = Bitstream(stream.codec_context.name, stream.codec_context.extradata)
        found = []
        for packet in container.demux(stream):
            kinds = [picture.pict_type for picture in packet.decode()]
            found.append((packet, kinds))
        return bitstream, [packet for packet, _ in found if packet.size]


def clip(folder, name):
    codec, options = CLIPS[name]
    return make_clip(folder / name, codec, "yuv420p", n=16, options=options)


@pytest.mark.parametrize(
    ("name", "coded"),
    [
        ("none.mp4", "R Rbbb Rbbb Rbbb"),  # three B pictures between two P, and nothing is built on them
        ("pyramid.mp4", "R RRbb RRbb RRbb"),  # the middle one is coded first, and is
        ("pyramid.ts", "R RRbb RRbb RRbb"),
        ("hevc.mp4", "R RRbb RRbb RRbb"),
    ],
)
def test_the_stream_says_which_pictures_others_are_built_on(tmp_path, name, coded):
    bitstream, sent = packets(clip(tmp_path, name))
    said = "".join("R" if bitstream.is_reference(packet) else "b" for packet in sent)
    assert said.startswith(coded.replace(" ", ""))


def test_where_only_the_type_tells_the_stream_does_not(tmp_path):
    bitstream, sent = packets(clip(tmp_path, "mpeg2.mpg"))
    assert bitstream.b_is_no_reference
    assert {bitstream.is_reference(packet) for packet in sent} == {None}
    assert bitstream.fault is None


@pytest.mark.parametrize("name", ["none.mp4", "pyramid.mp4", "slices.mov", "hevc.mp4"])
def test_whole_packets_have_no_fault_and_any_hole_of_zeros_is_one(tmp_path, name):
    bitstream, sent = packets(clip(tmp_path, name))
    assert {bitstream.fault(packet) for packet in sent} == {""}
    data = bytes(sent[0])
    for at in np.linspace(len(data) // 5, len(data) - 70, 7).astype(int):
        assert bitstream.fault(data[:at] + bytes(64) + data[at + 64 :])
    assert "does not fit" in bitstream.fault(data[:-3])


@pytest.mark.parametrize(
    ("name", "pix_fmt", "size", "rate"),
    [
        ("a.dv", "yuv411p", (720, 480), None),
        ("a.avi", "yuv420p", (720, 576), Fraction(25)),
        ("dv50.mov", "yuv422p", (720, 480), None),
    ],
)
def test_the_blocks_of_dv_are_known_by_their_places(tmp_path, name, pix_fmt, size, rate):
    how = {} if rate is None else {"rate": rate}
    bitstream, sent = packets(make_clip(tmp_path / name, "dvvideo", pix_fmt, n=2, size=size, **how))
    assert [bitstream.fault(packet) for packet in sent] == ["", ""]
    data = bytes(sent[0])
    rng = np.random.default_rng(0)
    for at in rng.integers(0, len(data) - 2000, 20):
        assert bitstream.fault(data[:at] + bytes(2000) + data[at + 2000 :])
        assert bitstream.fault(data[at:] + data[:at]) or at % 12000 == 0  # half of one frame, half of the next


def test_dv_of_a_size_that_is_not_known_is_let_be():
    assert Bitstream("dvvideo", None).fault(bytes(81)) == ""

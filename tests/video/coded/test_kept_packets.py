import os

import av
import numpy as np
import pytest

from benchmarks.damage import scene
from tests.files.clips import make_clip
from vidtrack.errors import VidtrackError
from vidtrack.video.coded import kept_packets
from vidtrack.video.coded.kept_packets import KeptPacket, KeptPackets

N = 12
KINDS = {
    "a.mp4": "libx264",
    "a.mov": "libx264",
    "a.mkv": "libx264",
    "a.webm": "libvpx-vp9",
    "a.avi": "mpeg4",
    "a.mxf": "mpeg2video",
    "a.ts": "libx264",
    "a.mpg": "mpeg2video",
    "a.h264": "libx264",
}
IN_PIECES = ("a.ts", "a.mpg")


def clip(tmp_path, name):
    return make_clip(tmp_path / name, KINDS[name], "yuv420p", n=N, picture=scene((160, 120), deep=False))


def packets(path):
    with av.open(str(path)) as container:
        return [packet for packet in container.demux(video=0) if packet.size]


def apart(path, kept):
    """Packets as they are kept while they are read."""
    return [kept.keep(packet) for packet in packets(path)]


@pytest.mark.parametrize("name", KINDS)
def test_each_packet_comes_back_as_often_as_it_is_wanted(tmp_path, name):
    path = clip(tmp_path, name)
    kept = KeptPackets(str(path))
    some = apart(path, kept)
    if name in IN_PIECES:
        assert sum(one.is_held for one in some) > N // 2
        kept.put_aside(some)
    assert name == "a.h264" or not any(one.is_held for one in some)
    for _ in range(2):
        for one, packet in zip(some, packets(path), strict=True):
            again = one.packet()
            assert bytes(one) == bytes(again) == bytes(packet)
            assert one.size == packet.size
            assert (again.pts, again.dts, again.is_keyframe) == (packet.pts, packet.dts, packet.is_keyframe)


def test_what_is_decoded_of_them_is_the_same(tmp_path):
    path = clip(tmp_path, "a.mp4")
    with av.open(str(path)) as container:
        extradata = container.streams.video[0].codec_context.extradata
    some, pictures = apart(path, KeptPackets(str(path))), []
    for row in (packets(path), [one.packet() for one in some]):
        codec = av.CodecContext.create("h264", "r")
        codec.extradata = extradata
        pictures.append([f.to_ndarray(format="gray") for packet in [*row, None] for f in codec.decode(packet)])
    assert len(pictures[0]) == N
    assert np.array_equal(*pictures)


def test_bytes_that_the_file_does_not_hold_at_their_place_are_not_read_from_there(tmp_path):
    """As where a demuxer takes a header off, or puts one in."""
    path = clip(tmp_path, "a.mp4")
    own = packets(path)[3]
    other = av.Packet(bytes(own)[:-1] + b"\xff" if bytes(own)[-1] != 255 else bytes(own)[:-1] + b"\0")

    class Claimed:
        pos, size, pts, dts, is_keyframe, is_corrupt, is_discard = own.pos, own.size, 1, 1, False, False, False

        def __bytes__(self):
            return bytes(other)

        def iter_sidedata(self):
            return iter(())

    one = KeptPackets(str(path)).keep(Claimed())
    assert one.is_held
    assert bytes(one) == bytes(other)


@pytest.mark.parametrize("mark", ["is_corrupt", "is_discard"])
def test_a_packet_that_is_more_than_its_bytes_and_times_is_held(tmp_path, mark):
    path = clip(tmp_path, "a.mp4")
    own = packets(path)[3]

    class Marked:
        pos, size, pts, dts, is_keyframe, is_corrupt, is_discard = own.pos, own.size, 1, 1, False, False, False

        def __bytes__(self):
            return bytes(own)

        def iter_sidedata(self):
            return iter(())

    kept = KeptPackets(str(path))
    assert not kept.keep(Marked()).is_held
    setattr(Marked, mark, True)
    one = kept.keep(Marked())
    kept.put_aside([one])
    assert one.is_held
    assert isinstance(one.packet(), Marked)


def test_where_no_file_can_be_written_they_are_held(tmp_path, monkeypatch):
    path = clip(tmp_path, "a.ts")
    kept = KeptPackets(str(path))
    some = apart(path, kept)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(kept_packets.os, "pwrite", full)
    kept.put_aside(some)
    assert sum(one.is_held for one in some) > N // 2
    assert [bytes(one) for one in some] == [bytes(packet) for packet in packets(path)]


def test_a_part_of_a_packet_is_not_taken_for_the_whole_where_the_disk_is_full(tmp_path, monkeypatch):
    path = clip(tmp_path, "a.ts")
    kept, write = KeptPackets(str(path)), os.pwrite
    some = apart(path, kept)
    monkeypatch.setattr(kept_packets.os, "pwrite", lambda number, data, at: write(number, data[: len(data) // 2], at))
    kept.put_aside(some)
    assert [bytes(one) for one in some] == [bytes(packet) for packet in packets(path)]


def test_files_are_closed_with_the_last_packet_in_them(tmp_path, monkeypatch):
    monkeypatch.setattr(kept_packets, "LIMITS", kept_packets.Limits(aside=3000))
    path, before = clip(tmp_path, "a.ts"), set(os.listdir("/proc/self/fd"))
    kept = KeptPackets(str(path))
    some = apart(path, kept)
    kept.put_aside(some)
    many = len(set(os.listdir("/proc/self/fd")) - before)
    assert many > 2
    del some[: N // 2]
    assert len(set(os.listdir("/proc/self/fd")) - before) < many
    del kept, some
    assert set(os.listdir("/proc/self/fd")) <= before
    assert [name for name in os.listdir(tmp_path) if name != "a.ts"] == []


def test_a_recording_that_became_shorter_is_said_to_be(tmp_path):
    path = clip(tmp_path, "a.mp4")
    last = apart(path, KeptPackets(str(path)))[-1]
    os.truncate(path, 100)
    with pytest.raises(VidtrackError, match="became shorter while it was read"):
        bytes(last)


def test_a_recording_that_cannot_be_read_again_is_said_to_be(tmp_path, monkeypatch):
    path = clip(tmp_path, "a.mp4")
    last = apart(path, KeptPackets(str(path)))[-1]

    def broken(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(kept_packets.os, "pread", broken)
    with pytest.raises(VidtrackError, match="cannot be read again"):
        bytes(last)


def test_a_packet_alone_is_held(tmp_path):
    own = packets(clip(tmp_path, "a.mp4"))[0]
    assert KeptPacket(own).is_held
    assert KeptPacket(own).packet() is own

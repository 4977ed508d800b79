"""Other endings of coded pictures are written so that a decoder takes them for what the stream holds."""

from __future__ import annotations

import av
import numpy as np
import pytest

from tests.files.clips import make_clip
from tests.video.faults.test_second_look import KINDS
from vidtrack.video.coded.bitstream import unit_places
from vidtrack.video.coded.coded_units import CodedUnits, _alone_in_mpeg4, _last_of_superframe, _without_stuffing


def test_of_mpeg_4_key_frames_that_lie_alone_in_their_packets_are_looked_at():
    """With Xvid's packed packets healthy pictures were found: a time stamp is not that of the last picture in it."""
    key, b = b"\0\0\1\xb0\x01" + b"\0\0\1\xb6\x10" + bytes(range(9, 99)), b"\0\0\1\xb6\x90" + bytes(range(9, 99))
    assert _alone_in_mpeg4(key + bytes(500), any_type=False) == [(5, len(key))]
    assert _alone_in_mpeg4(b, any_type=True) == [(0, len(b))]
    assert [_alone_in_mpeg4(data, any_type=False) for data in (b, key + b, key[:9], b"", bytes(9))] == [[]] * 5


def test_the_last_frame_of_a_packet_of_vp9_lies_before_the_index_of_sizes():
    index = bytes([0xC9, 10, 0, 20, 0, 0xC9])  # two frames, sizes of two bytes
    assert _last_of_superframe(bytes(30) + index) == (10, 30)
    assert _last_of_superframe(bytes([1] * 30)) == (0, 30)
    assert _last_of_superframe(bytes([1] * 30 + [0xC9])) == (0, 31)  # a byte of data that looks like an index


def test_units_of_av1_bear_their_sizes():
    header, frame = bytes([1 << 3 | 2, 3, 9, 9, 9]), bytes([6 << 3 | 2, 0x82, 0x01]) + bytes(130)
    assert unit_places(header + frame) == [(8, 138)]
    assert unit_places(frame + header) == []  # what is last holds no picture


def test_zeros_behind_a_unit_do_not_count():
    assert _without_stuffing(b"\x65\x88\x80\0\0\3\0\0\3") == b"\x65\x88\x80"
    assert _without_stuffing(b"\x65\0\0\3\x80") == b"\x65\0\0\3\x80"


@pytest.mark.parametrize("name", ["hevc.mp4", "vp9.webm", "av1.mkv"])
def test_bytes_behind_the_units_of_a_whole_picture_are_never_read(tmp_path, name):
    codec, options = KINDS[name]
    path = make_clip(tmp_path / name, codec, "yuv420p", n=5, options=options)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        codec, extradata = stream.codec_context.name, stream.codec_context.extradata
        sent = [bytes(packet) for packet in container.demux(stream) if packet.size]
    units, longer = CodedUnits(codec, extradata), 0

    def decoded(packets):
        context = av.CodecContext.create(codec, "r")
        context.extradata = extradata
        pictures = [f for data in packets for f in context.decode(av.Packet(data))] + context.decode(None)
        return [picture.to_ndarray(format="gray") for picture in pictures if not picture.is_corrupt]

    whole = decoded(sent)
    for i, data in enumerate(sent):
        places = units.places(data)
        other = units.longer(data, places, 8, seed=i) if places else None
        if other is not None:
            longer += 1
            assert len(other) >= len(data) + 8 * len(places)
            assert np.array_equal(decoded([*sent[:i], other, *sent[i + 1 :]]), whole)
            assert len(units.places(other)) == len(places)
    assert longer >= 3
    assert len(whole) == 5


def test_a_longer_frame_of_vp9_keeps_an_index_that_can_hold_its_size():
    units, index = CodedUnits("vp9", None), bytes([0xC1, 10, 20, 0xC1])  # two frames, sizes of one byte
    longer = units.longer(bytes(30) + index, [(10, 30)], 3, seed=1)
    assert longer[:30] == bytes(30)
    assert longer[30:33] == bytes(3)  # as if nothing were there
    assert longer[36:] == bytes([0xC1, 10, 26, 0xC1])
    assert units.longer(bytes(260) + bytes([0xC1, 10, 250, 0xC1]), [(10, 260)], 30, seed=1) is None


def test_a_unit_of_av1_that_does_not_bear_its_size_gets_no_longer():
    units, data = CodedUnits("av1", None), bytes([6 << 3]) + bytes(range(1, 100))
    assert units.longer(data, [(1, 100)], 3, seed=1) is None


def test_more_data_of_h264_may_be_one_more_macroblock():
    """Its plainer code (CAVLC) ends with the last bit: bytes behind it are read."""
    assert CodedUnits("h264", None).longer(b"\0\0\1\x65" + bytes(range(9, 99)), [(3, 94)], 3, seed=1) is None


def test_the_tail_of_a_unit_is_replaced_in_place():
    units, data = CodedUnits("h264", None), b"\0\0\1" + bytes(30)
    other = units.with_tail(data, (3, 30), 4, seed=1)
    assert other[:26] == data[:26]
    assert min(other[26:30]) >= 4  # no start code
    assert other[30:] == data[30:]
    assert len(other) == len(data)

"""A taller H.264 picture shows whether its data end where the true one does."""

from __future__ import annotations

import av
import numpy as np
import pytest

from tests.files.clips import make_clip
from vidtrack.video.coded.bitstream import Bitstream
from vidtrack.video.coded.taller import _Bits, _escaped, taller_headers, taller_packet

OPTIONS = {
    "high": {},
    "baseline": {"profile": "baseline"},
    "scaling lists": {"x264-params": "cqm=jvt"},
    "10 bits": {},
    "444": {},
}
FORMATS = {"10 bits": "yuv420p10le", "444": "yuv444p"}


@pytest.mark.parametrize("kind", OPTIONS)
@pytest.mark.parametrize("ending", ["mp4", "ts"])
def test_a_picture_is_a_row_of_macroblocks_taller_and_its_own_part_stays(tmp_path, kind, ending):
    deep = "10" in kind
    picture = (lambda i: np.full((120, 160), 400, np.uint16)) if deep else None
    path = make_clip(
        tmp_path / f"a.{ending}",
        "libx264",
        FORMATS.get(kind, "yuv420p"),
        n=12,
        options=OPTIONS[kind] | {"bf": "0"},
        picture=picture,
    )
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        extradata = stream.codec_context.extradata
        sent = [bytes(packet) for packet in container.demux(stream) if packet.size]
    bitstream = Bitstream("h264", extradata)

    def decoded(extradata, packets):
        context = av.CodecContext.create("h264", "r")
        context.extradata, context.thread_count = extradata, 1
        context.options = {"skip_loop_filter": "all"}
        return [f for data in packets for f in context.decode(av.Packet(data))] + context.decode(None)

    whole = decoded(extradata, sent)
    taller = decoded(taller_headers(extradata), [taller_packet(data, bitstream) for data in sent])
    assert [(f.width, f.height, f.is_corrupt) for f in whole] == [(160, 120, False)] * 12
    assert [(f.width, f.height, f.is_corrupt) for f in taller] == [(160, 136, True)] * 12
    first, other = (f[0].to_ndarray(format="gray16le" if deep else "gray") for f in (whole, taller))
    assert np.array_equal(first[:48], other[:48])  # the decoder hides what is missing in up to 50 macroblocks above it


def test_headers_that_allow_interlaced_pictures_or_cannot_be_read_are_let_be(tmp_path):
    path = make_clip(tmp_path / "a.mp4", "libx264", "yuv420p", n=2, options={"x264-params": "interlaced=1"})
    with av.open(str(path)) as container:
        assert taller_headers(container.streams.video[0].codec_context.extradata) is None
    assert taller_headers(None) is None
    assert taller_headers(b"") is None
    assert taller_headers(b"\0\0\1\x67\x64") is None
    assert taller_packet(b"\0\0\1\x67\x64", Bitstream("h264", None)) is None
    assert taller_packet(b"\0\0\1\x65\x64", Bitstream("h264", None)) == b"\0\0\1\x65\x64"


def test_numbers_of_the_stream_by_hand():
    """H.264, table 9-2: 1, 010, 011, 00100 are 0, 1, 2, 3; signed: 0, 1, -1, 2."""
    bits = _Bits(bytes([0b10100110, 0b01000000]))
    assert [bits.number() for _ in range(4)] == [0, 1, 2, 3]
    bits.at = 0
    assert [bits.signed() for _ in range(4)] == [0, 1, -1, 2]


def test_no_start_code_is_seen_in_a_unit():
    assert _escaped(bytes([0, 0, 1, 0, 0, 0, 0, 9])) == bytes([0, 0, 3, 1, 0, 0, 3, 0, 0, 9])

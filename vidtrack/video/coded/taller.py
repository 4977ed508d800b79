"""The same H.264 stream with one row of macroblocks more in its pictures, which their data then do not reach.

A slice says behind each macroblock whether it was the last. Decoders stop at the last one of the picture, whatever it
says; where the picture is taller, a whole slice still ends there, and one that was read as garbage goes on: it was not
at its end. How macroblocks are read depends on those beside and above them alone, so that all else stays as it was.
"""

from __future__ import annotations

from vidtrack.video.coded.bitstream import Bitstream

_PARAMETERS = 7
"""Type of the unit that holds the picture's size (ITU-T H.264, table 7-1)."""


def taller_headers(extradata: bytes | None) -> bytes | None:
    """The headers of a stream, as containers give them; None where they cannot be read, or allow interlaced pictures.

    They are a list of units with lengths (ISO/IEC 14496-15, 5.3.3.1: MP4, Matroska) or units behind start codes.
    """
    try:
        if not extradata:
            return None
        if extradata[0] != 1:
            return _with_taller(extradata, Bitstream("h264", None))
        at, out = 6, bytearray(extradata[:6])
        for _ in range(extradata[5] & 31):
            end = at + 2 + int.from_bytes(extradata[at : at + 2])
            unit = _taller_unit(extradata[at + 2 : end])
            out += len(unit).to_bytes(2) + unit
            at = end
        return bytes(out) + extradata[at:]
    except (IndexError, ValueError):
        return None


def taller_packet(data: bytes, bitstream: Bitstream) -> bytes | None:
    """A packet in which headers are taller, if it holds any; None where they cannot be read."""
    try:
        return _with_taller(data, bitstream)
    except (IndexError, ValueError):
        return None


def _with_taller(data: bytes, bitstream: Bitstream) -> bytes:
    for begin, end in reversed(bitstream.places(data)):
        if data[begin] & 31 == _PARAMETERS:
            unit, n = _taller_unit(data[begin:end]), bitstream.length
            data = data[: begin - n] + (len(unit).to_bytes(n) if n else b"") + unit + data[end:]
    return data


class _Bits:
    """Reads bits and the stream's variable-length numbers (H.264, 9.1)."""

    def __init__(self, data: bytes) -> None:
        self.bits = "".join(f"{byte:08b}" for byte in data)
        self.at = 0

    def bit(self, n: int = 1) -> int:
        self.at += n
        return int(self.bits[self.at - n : self.at], 2)

    def number(self) -> int:
        zeros = self.bits.index("1", self.at) - self.at
        self.at += zeros
        return self.bit(zeros + 1) - 1

    def signed(self) -> int:
        n = self.number()
        return (n + 1) // 2 if n % 2 else -(n // 2)


def _taller_unit(unit: bytes) -> bytes:
    """A sequence parameter set (H.264, 7.3.2.1.1) whose height is a row more; ValueError where it is interlaced."""
    bits = _Bits(unit[1:].replace(b"\0\0\3", b"\0\0"))
    profile = bits.bit(24) >> 16
    bits.number()
    if profile in _WITH_CHROMA:
        colours = bits.number()
        if colours == _SEPARATE:
            bits.bit()
        bits.number(), bits.number(), bits.bit()
        if bits.bit():
            for i in range(12 if colours == _SEPARATE else 8):
                _pass_scaling_list(bits, 16 if i < 6 else 64)
    bits.number()
    order = bits.number()
    if order == 0:
        bits.number()
    elif order == 1:
        bits.bit(), bits.signed(), bits.signed()
        for _ in range(bits.number()):
            bits.signed()
    bits.number(), bits.bit(), bits.number()
    begin = bits.at
    rows = bits.number()
    if not bits.bit():
        raise ValueError("pictures may be interlaced")
    code = f"{rows + 2:b}"
    changed = bits.bits[:begin] + "0" * (len(code) - 1) + code + bits.bits[bits.at - 1 :].rstrip("0")
    changed += "0" * (-len(changed) % 8)
    return unit[:1] + _escaped(int(changed, 2).to_bytes(len(changed) // 8))


def _pass_scaling_list(bits: _Bits, size: int) -> None:
    last = following = 8
    for _ in range(size if bits.bit() else 0):
        if following:
            following = (last + bits.signed()) % 256
        last = following or last


def _escaped(data: bytes) -> bytes:
    """With a 3 behind two zeros, where a start code would be seen (H.264, 7.4.1)."""
    out, zeros = bytearray(), 0
    for byte in data:
        if zeros >= 2 and byte <= 3:
            out.append(3)
            zeros = 0
        out.append(byte)
        zeros = 0 if byte else zeros + 1
    return bytes(out)


_WITH_CHROMA = (100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135)
"""Profiles whose parameters say how colour is sampled."""
_SEPARATE = 3
"""Of colour sampled as densely as luma."""

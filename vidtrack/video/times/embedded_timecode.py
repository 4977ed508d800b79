"""Time code that a video file carries beside its pictures: container tags, DV subcode, GOP headers, AVI `ISMP`."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any, BinaryIO

from vidtrack.video.times.atoms import atoms

_TAG_OF = {"mov,mp4,m4a,3gp,3g2,mj2": "tmcd", "mxf": "mxf", "matroska,webm": "matroska", "avi": "ismp", "dv": "dv"}
_LABEL = re.compile(rb"\d\d:\d\d:\d\d[:;.]\d\d")

_TMCD = re.compile(
    rb"stsd\0{4}.{4}.{4}tmcd\0{6}..\0{4}.{4}(?P<scale>.{4})(?P<duration>.{4})", re.DOTALL
)  # in its table of sample descriptions: in an MP4 the handler is called tmcd too, and its name follows twelve zeros
_TIMECODE_COMPONENT = bytes.fromhex("060e2b34025301010d01010101011400")
_MXF_HEADER = 1 << 20

ZERO = ("00:00:00:00", "00:00:00;00", "00:00:00.00")
"""Labels of a counter that was never set."""


def embedded_timecodes(container: Any, stream: Any, first: Any, dv_code: str | None) -> dict[str, str]:
    """Where a time code was found -> the label of the first picture; the most trustworthy first, unset ones last.

    first    the first picture
    dv_code  what its DV packet says, if it is one
    """
    codes: dict[str, str] = {}
    if dv_code:
        codes["dv"] = dv_code
    tag = _TAG_OF.get(container.format.name, container.format.name)
    for holder in (stream, *container.streams, container):
        for key, value in holder.metadata.items():
            if key.lower() == "timecode" and value:
                codes.setdefault(tag, value)
    if tag == "ismp" and tag not in codes and (label := _ismp_in_header(container.name)):
        codes[tag] = label
    of_picture = first.metadata.get("timecode")
    if of_picture:
        # MPEG-2 counts in its group headers, H.264 and HEVC in picture timing (ST 12-1 in SEI); only the first is sure
        codes["gop" if stream.codec_context.name.startswith("mpeg") else "sei"] = of_picture
    return dict(sorted(codes.items(), key=lambda item: item[1] in ZERO))


def code_bases(container: Any, codes: dict[str, str]) -> dict[str, Fraction]:
    """Source -> labels a second of its time code, where the container says so (of `codes`, tmcd and mxf do).

    Recorders of 50 or 60 pictures a second count 25 or 30 as often: 10:00:00:12 is then 0.48 s past ten, not 0.24 s.
    A whole number where a container gives no more (MXF: 30 for 29.97).
    """
    found = {"tmcd": _base_in_mov, "mxf": _base_in_mxf}
    bases = {}
    for source in found.keys() & codes.keys():
        with open(container.name.removeprefix("file:"), "rb") as file:
            if base := found[source](file):
                bases[source] = base
    return bases


def _base_in_mov(file: BinaryIO) -> Fraction | None:
    """Time scale over frame duration of the first tmcd sample description (QuickTime File Format, Timecode Media)."""
    for kind, (begin, end) in atoms(file):
        if kind == b"moov":
            file.seek(begin)
            for entry in _TMCD.finditer(file.read(end - begin)):
                scale, duration = (int.from_bytes(entry[part]) for part in ("scale", "duration"))
                if 0 < duration <= scale <= 1000 * duration:
                    return Fraction(scale, duration)
    return None


def _base_in_mxf(file: BinaryIO) -> Fraction | None:
    """The rounded timecode base of the first timecode component (SMPTE ST 377-1, B.16)."""
    head = file.read(_MXF_HEADER)
    at = head.find(_TIMECODE_COMPONENT)
    if at < 0:
        return None
    at += 16
    long = head[at] & 0x7F if head[at] & 0x80 else 0  # the length's own length
    end = at + 1 + long + (int.from_bytes(head[at + 1 : at + 1 + long]) if long else head[at])
    at += 1 + long
    while at + 4 <= min(end, len(head)):
        tag, size = int.from_bytes(head[at : at + 2]), int.from_bytes(head[at + 2 : at + 4])
        if tag == 0x1502:
            return Fraction(int.from_bytes(head[at + 4 : at + 4 + size])) or None
        at += 4 + size
    return None


def _ismp_in_header(name: str) -> str | None:
    """The label of an `ISMP` chunk, which old capture programs put into the header list, where no library looks."""
    with open(name.removeprefix("file:"), "rb") as file:
        head = file.read(1 << 16)
    at = head.find(b"ISMP", 0, head.find(b"movi") if b"movi" in head else len(head))
    found = _LABEL.match(head, at + 8) if at >= 0 else None
    return found.group().decode() if found else None


def code_of_dv(pack: bytes | memoryview) -> str | None:
    """The label in a DV time code pack (0x13), its five bytes; None where it is another, empty or no label.

    IEC 61834-4: binary-coded decimal, frames first; bit 6 of the frames is the drop-frame flag.
    """
    if len(pack) < 5 or pack[0] != 0x13 or pack[1] == 0xFF:
        return None
    frames, seconds, minutes, hours = (
        10 * (byte >> 4 & tens) + (byte & 0xF) for byte, tens in zip(pack[1:5], (3, 7, 7, 3), strict=True)
    )
    if hours > 23 or minutes > 59 or seconds > 59 or frames > 29:
        return None
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}{';' if pack[1] & 0x40 else ':'}{frames:02d}"


def code_of_dv_packet(packet: Any) -> str | None:
    """The label in a raw DV frame: the pack at bytes 86 to 90 of its first subcode block; None where there is none."""
    return code_of_dv(memoryview(packet)[86:91])

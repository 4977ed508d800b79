"""Time code that a video file carries beside its pictures: container tags, DV subcode, MPEG-2 GOP headers."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from vidtrack.timebase import code_rate_of
from vidtrack.timecode import Timecode, parse

_TAG_OF = {"mov,mp4,m4a,3gp,3g2,mj2": "tmcd", "mxf": "mxf", "matroska,webm": "matroska", "avi": "avi", "dv": "dv"}


def embedded_timecodes(container: Any, stream: Any, first: Any, dv_code: str | None) -> dict[str, str]:
    """Where a time code was found -> the label of the first picture, the most trustworthy first."""
    codes: dict[str, str] = {}
    if dv_code:
        codes["dv"] = dv_code
    tag = _TAG_OF.get(container.format.name, container.format.name)
    for holder in (stream, *container.streams, container):
        for key, value in holder.metadata.items():
            if key.lower() == "timecode" and value and tag not in codes:
                codes[tag] = value
    of_frame = first.metadata.get("timecode")
    if of_frame:
        codes["gop"] = of_frame
    return codes


def first_code(codes: dict[str, str], rate: Fraction) -> tuple[str, Timecode | None]:
    """The first source whose label can be read, and its code; ("none", None) where there is none."""
    for source, label in codes.items():
        if source == "gop" and label[:8] == "00:00:00":
            continue  # encoders write it unasked
        try:
            return source, parse(label, code_rate_of(rate))
        except ValueError:
            continue
    return "none", None


def code_of_dv_packet(packet: Any) -> str | None:
    """The label in a raw DV frame: pack 0x13 of the first subcode block, bytes 86 to 90; None where it is empty."""
    pack = memoryview(packet)[86:91]
    if len(pack) < 5 or pack[0] != 0x13 or pack[1] == 0xFF:
        return None
    frames, seconds, minutes, hours = (
        10 * (byte >> 4 & tens) + (byte & 0xF) for byte, tens in zip(pack[1:], (3, 7, 7, 3), strict=True)
    )
    return f"{hours:02d}:{minutes:02d}:{seconds:02d}{';' if pack[1] & 0x40 else ':'}{frames:02d}"

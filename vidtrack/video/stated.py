"""What containers and codecs state of rate, length and fields, put right where it is known to be wrong."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

_FIELD_ORDER = {1: "progressive", 2: "top", 3: "bottom", 4: "bottom", 5: "top"}
"""libavcodec's AVFieldOrder, by which field is shown first; 0 is unknown."""

COMMON_RATES = {Fraction(n) for n in (24, 25, 30, 50, 60)} | {Fraction(n * 1000, 1001) for n in (24, 30, 60)}
LOST_SHARE = 0.4
"""Share of its frames that a recording may have lost and still be taken for one of the next common rate; one of every
second frame (fields counted as frames) is not."""


def stated_rate(container: Any, stream: Any) -> Fraction:
    # raw DV has an average of 60000/1 (its time base); base and guessed are right there
    rates = (stream.base_rate, stream.guessed_rate) if container.format.name == "dv" else ()
    # frames that were lost lower the average; the rate that was meant is a common one just above it
    if stream.average_rate and stream.guessed_rate and stream.guessed_rate in COMMON_RATES:
        meant = Fraction(stream.guessed_rate)
        if 0 < 1 - stream.average_rate / meant < LOST_SHARE:
            return meant
    for rate in (*rates, stream.average_rate, stream.guessed_rate, stream.base_rate):
        if rate:
            return Fraction(rate)
    return Fraction(25)


def stated_duration(container: Any, stream: Any, rate: Fraction) -> Fraction | None:
    """What a header, not a guess from the size of the file, says of the length of the pictures, s."""
    kind = container.format.name
    if kind == "avi" and stream.frames:  # the duration is put right from what was found, the count is not
        return Fraction(stream.frames) / rate
    if kind in ("mov,mp4,m4a,3gp,3g2,mj2", "mxf") and stream.duration:
        return Fraction(stream.duration) * Fraction(stream.time_base)
    tag = stream.metadata.get("DURATION", "")  # Matroska, 00:01:02.345000000
    parts = tag.split(":")
    if len(parts) == 3 and tag.replace(":", "").replace(".", "").isdigit():
        return Fraction(parts[2]) + 60 * int(parts[1]) + 3600 * int(parts[0])
    return None


def flagged_order(codec: Any, first: Any) -> str:
    if codec.name == "dvvideo" and first.interlaced_frame:
        return "bottom"  # IEC 61834: the lower field comes first, at 525 and 625 lines; DV flags neither
    order = _FIELD_ORDER.get(codec.field_order, "unknown")
    return "unknown" if order == "progressive" and first.interlaced_frame else order

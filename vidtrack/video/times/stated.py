"""What containers and codecs state of rate, length and fields, put right where it is known to be wrong."""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import pairwise
from typing import Any

from vidtrack.video.container import open_container

_FIELD_ORDER = {1: "progressive", 2: "top", 3: "bottom", 4: "bottom", 5: "top"}
"""libavcodec's AVFieldOrder, by which field is shown first; 0 is unknown."""

COMMON_RATES = {Fraction(n) for n in (24, 25, 30, 50, 60)} | {Fraction(n * 1000, 1001) for n in (24, 30, 60)}
LOST_SHARE = 0.4
"""Share of its frames that a recording may have lost and still be taken for one of the next common rate; one of every
second frame (fields counted as frames) is not."""


FASTEST_USUAL = 200
"""Frames a second: where more are stated, the stamps are looked at. Browsers write 1000, the scale of their stamps."""

LOOKED_AT = 64
"""Stamps from which a rate is measured."""


def measured_rate(path: str, index: int) -> Fraction | None:
    """Frames a second by the first time stamps of stream `index`; None where there are too few."""
    stamps: list[int] = []
    with open_container(path) as container:
        stream = container.streams[index]
        for packet in container.demux(stream):
            if packet.pts is not None:
                stamps.append(packet.pts)
            if len(stamps) == LOOKED_AT:
                break
        if len(stamps) < 3 or not max(stamps) > min(stamps):
            return None
        stamps = sorted(set(stamps))
        steps = sorted(b - a for a, b in pairwise(stamps))
        usual = steps[len(steps) // 2]
        run = [step for step in steps if step < 1.5 * usual]  # without gaps
        mean = Fraction(len(run), sum(run)) / stream.time_base
    near = [rate for rate in COMMON_RATES if abs(mean / rate - 1) < Fraction(1, 50)]
    return min(near, key=lambda rate: abs(mean / rate - 1)) if near else mean


RAW = frozenset(
    "avs2 avs3 cavsvideo dirac dnxhd evc h261 h263 h264 hevc m4v mjpeg mpegvideo obu vc1 vvc".split()  # noqa: SIM905
)
"""Streams without a container: what their time stamps say is the demuxer's guess, unless the stream states a rate."""


def rate_is_invented(container: Any, stream: Any) -> bool:
    """Whether a rate is stated nowhere, so that libavformat takes 25."""
    kind = container.format.name
    return kind == "ser" or (kind in RAW and not stream.codec_context.framerate)


def stated_rate(container: Any, stream: Any) -> Fraction:
    """Frames a second, by the header, or by the stamps where what it states is the scale of its stamps."""
    if container.format.name in RAW and stream.codec_context.framerate:
        return Fraction(stream.guessed_rate or stream.codec_context.framerate)
    rate = _header_rate(container, stream)
    if rate > FASTEST_USUAL and container.format.name == "matroska,webm":
        measured = measured_rate(container.name.removeprefix("file:"), stream.index)
        if measured is not None and measured < Fraction(4, 5) * rate:
            return measured
    return rate


def _header_rate(container: Any, stream: Any) -> Fraction:
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
    if found := re.fullmatch(r"([0-9]{1,6}):([0-9]{1,2}):([0-9]{1,2}(?:\.[0-9]{0,12})?)", tag):
        end = Fraction(found[3]) + 60 * int(found[2]) + 3600 * int(found[1])
        first = Fraction(stream.start_time or 0) * Fraction(stream.time_base or 1)
        # ASSUME: counted from the file's time 0, as libavformat writes it; other programs count from the first picture
        return end - first if 0 < first < end else end
    return None


def flagged_order(codec: Any, first: Any) -> str:
    if codec.name == "dvvideo" and first.interlaced_frame:
        return "bottom"  # IEC 61834: the lower field comes first, at 525 and 625 lines; DV flags neither
    order = _FIELD_ORDER.get(codec.field_order, "unknown")
    return "unknown" if order == "progressive" and first.interlaced_frame else order

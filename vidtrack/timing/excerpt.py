"""The frames of a recording between two instants that a person named."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.timing.timecode import parse

Instant = str | int
"""A time code, or the number of a frame."""


def between(
    frames: Iterable[Frame], info: VideoInfo, start: Instant | None, end: Instant | None, *, where: str
) -> Iterator[Frame]:
    """The frames from start to end, both included; None leaves that side open.

    where  the place of the two settings in the config, for messages
    Raises VidtrackError, before a frame is read, for a time code that is none or that the recording cannot be held to,
    for a number below 0 and an end before the start, and, when the frames have come to their end, where none of them
    lay between.
    """
    first, last = (_instant(f"{where}.{word}", value, info) for word, value in (("start", start), ("end", end)))
    if first is None and last is None:
        return iter(frames)
    if isinstance(first, int) == isinstance(last, int) and first is not None and last is not None and last < first:
        raise VidtrackError(f"{where}.end: {end!r} lies before start, {start!r}. Exchange them, or correct one.")
    return _some(iter(frames), (first, last, 0.5 / float(info.rate)), (start, end), info, where)


def _some(
    frames: Iterator[Frame],
    limits: tuple[int | float | None, int | float | None, float],
    asked: tuple[Instant | None, Instant | None],
    info: VideoInfo,
    where: str,
) -> Iterator[Frame]:
    read: list[Frame] = []

    def noted() -> Iterator[Frame]:
        for frame in frames:
            read[:] = [read[0] if read else frame._replace(luma=frame.luma[:0]), frame._replace(luma=frame.luma[:0])]
            yield frame

    chosen = _chosen(noted(), *limits)
    one = next(chosen, None)
    if one is None:
        more = next(frames, None) is not None  # an end before the first frame: the rest is not read for a message
        start, end = ("its first frame" if asked[0] is None else asked[0]), "its end" if asked[1] is None else asked[1]
        begins = _named(read[0], info) if read else ""
        has = f"it begins with frame {begins}" if more else f"it has frames {begins} to {_named(read[-1], info)}"
        has = has if read else "it has none"
        raise VidtrackError(
            f"{where}.start: no frame of the recording lies between {start} and {end}: {has}. Choose a start within it."
        )
    yield one
    yield from chosen


def _named(frame: Frame, info: VideoInfo) -> str:
    """Its number, and its label where the recording has a time code."""
    label = str(info.time.labels(float(frame.time))) if info.time.anchors else ""
    return f"{frame.index} ({label})" if label else f"{frame.index}"


def _chosen(
    frames: Iterable[Frame], first: int | float | None, last: int | float | None, slack: float
) -> Iterator[Frame]:
    for frame in frames:
        time = float(frame.time)
        if first is not None and (frame.index < first if isinstance(first, int) else time < first - slack):
            continue
        if last is not None and (frame.index > last if isinstance(last, int) else time > last + slack):
            return
        yield frame


def _instant(where: str, value: Instant | None, info: VideoInfo) -> int | float | None:
    """A frame number as it is; a time code as seconds after the first frame."""
    if isinstance(value, int) and value < 0:
        raise VidtrackError(f"{where}: {value} is no frame: frames are counted from 0. Give a number or a time code.")
    if value is None or isinstance(value, int):
        return value
    if not info.time.anchors:
        raise VidtrackError(
            f"{where}: {value!r} is a time code, but the recording carries none. "
            "Give a frame number or, for a run, its start_timecode."
        )
    try:
        code = parse(value, info.time.code_rate, info.time.drop or None)
    except ValueError as error:
        raise VidtrackError(f"{where}: {error}.") from None
    return info.time.time_of(code)

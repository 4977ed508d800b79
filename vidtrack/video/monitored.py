"""Frames that are looked at by the process that decodes them, where the one that uses them has more to do.

A quick decoder waits for a program that measures many targets. What looks at each picture that passes, and answers
when all have passed, may do so in the decoder's process.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple, cast

from numpy.typing import DTypeLike

from vidtrack.timing.frame import Frame, Luma
from vidtrack.video.faults.account import ReadingLog
from vidtrack.video.framed import Framing
from vidtrack.video.processes.read_apart import ReadApart
from vidtrack.video.processes.shares import Decoding, Report, gone_on_with, with_reports
from vidtrack.video.recording import Monitor

SPARE = {"dvvideo": 150, "mpeg1video": 1, "mpeg2video": 1}
"""Codec -> targets from which on its decoder waits for those who follow them, of 720 x 480 px."""

MORE_AHEAD = 1.5
"""Times the memory for pictures that wait: while hundreds of targets are found, more come."""


class Looked(NamedTuple):
    """What the other process knows at the end: the log of the reading, what the decoder said, and `Monitor.seen`."""

    log: ReadingLog
    said: Report
    seen: Any


def frames_monitored(
    here: Decoding,
    framing: Framing,
    monitor: Monitor,
    opened: Callable[[], Decoding],
    shape: Sequence[int],
    dtype: DTypeLike,
    memory: int,
    path: str,
) -> Generator[Frame, None, Looked | None]:
    """The frames of a recording, decoded and looked at by a process of its own, and what that knows; None where no
    process can be had: this one decodes, and the frames have not been looked at.

    here    the recording as it is open: the new process goes on with it, and this one reads no more of it
    opened  opens it again; shape, dtype, memory, path: as `ReadApart` has them
    """
    try:
        memory = int(MORE_AHEAD * memory)
        reader = ReadApart(partial(_looked_at, here, framing, monitor), shape, dtype, memory, path)
    except OSError:  # too many processes, or too little memory for another
        yield from framing.frames(gone_on_with(opened, 0))
        return None
    finally:
        here.first = None
    monitor.elsewhere()
    try:
        for luma, what in reader:
            if luma is None:
                return cast(Looked, what)
            index, time, *rest = what
            yield Frame(index, Fraction(*time), luma, *rest)
    finally:
        reader.close()
    return None


def _looked_at(here: Decoding, framing: Framing, monitor: Monitor) -> Iterator[tuple[Luma | None, Any]]:
    """In a process of its own: pictures, and what else their frames have; at the end what is known."""
    for frame in monitor.monitored(framing.frames(with_reports(lambda: here))):
        index, time, luma, *rest = frame
        yield luma, (index, time.as_integer_ratio(), *rest)  # a Fraction is passed on as text, which takes long to read
    yield None, Looked(framing.log, here.reported(), monitor.seen())

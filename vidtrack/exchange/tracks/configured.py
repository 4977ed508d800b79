"""What config.yaml says of a file of tracks: which targets are meant, and when its frames were taken."""

from __future__ import annotations

from dataclasses import replace

from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Digitised
from vidtrack.timing.timebase import TimeBase, code_rate_of, time_base
from vidtrack.timing.timecode import Timecode, exact_rate, parse


def chosen(tracks: Digitised, names: list[str] | None, where: str) -> Digitised:
    """The targets that the config names, in its order; all where it names none."""
    if not names:
        return tracks
    if missing := [name for name in names if name not in tracks.names]:
        raise VidtrackError(
            f"config.yaml: {where}.targets: no {missing[0]} among the tracks; there are {', '.join(tracks.names[:8])}. "
            "Correct the names."
        )
    return replace(tracks, names=tuple(names), b=tracks.b[:, [tracks.names.index(name) for name in names]])


def clock_of(tracks: Digitised, rate: float | None, start_timecode: str | None, where: str) -> TimeBase:
    """The time of frames: the rate of the config, else of the file; the code of the file, else of the config.

    Raises VidtrackError where there is no rate, and for a code that is none.
    """
    given = rate or tracks.rate
    if given is None:
        raise VidtrackError(
            f"config.yaml: {where}.rate: a {tracks.format} file does not say how many pictures were taken a "
            "second. Give it, "
            "as in rate: 120."
        )
    exact = exact_rate(float(given))
    if tracks.code:
        code_rate = exact_rate(30000 / 1001)
        parsed = parse(tracks.code[0], code_rate, drop=False)
        return time_base(code_rate, Timecode(parsed.frame, code_rate), source="file")
    if start_timecode:
        try:
            return time_base(exact, parse(start_timecode, code_rate_of(exact)), source="config")
        except ValueError as error:
            raise VidtrackError(f"config.yaml: {where}.start_timecode: {error}.") from None
    return time_base(exact) if not tracks.together else replace(time_base(exact), source="rows")

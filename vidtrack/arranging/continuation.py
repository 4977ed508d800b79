"""Files that one recording was split into: found by names that count on, decided by their stamps.

Cameras begin a new file every few gigabytes: 00001.MTS, DJI_0002.MP4, C0003.MP4, MVI_0004.MOV, tape-005.dv, and people
write swim_1.mp4, swim_2.mp4. The same names are given to takes, cameras and tests, so that a name decides nothing here:
a file goes on where another ends if its stamps, its time code or its time of creation say so.
"""

from __future__ import annotations

import fnmatch
import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from typing import NamedTuple

from vidtrack.arranging.inventory import Recording
from vidtrack.errors import VidtrackError
from vidtrack.naming import in_order


@dataclass(frozen=True)
class Limits:
    """When a file goes on where another ends.

    frames   between them by stamps or time code, at most: a picture may be lost at a split
    created  s: times of creation are in whole seconds, at the beginning or the end of a file
    full     files end here: 2 and 4 GiB, and decimal ones; share by which a file may be smaller
    """

    frames: float = 3.0
    created: float = 1.5
    full: tuple[float, ...] = (2.0**31, 2.0**32, 2e9, 4e9)
    share: float = 0.04


LIMITS = Limits()

_PART = re.compile(r"(part|teil|chapter|chap|reel|pt)[ _.-]*\d+\)?$", re.IGNORECASE)
"""Names that say that a file is a part of a recording."""

_DAY, _CLOCK = r"(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)", r"([0-2]\d)[-_.:h]?([0-5]\d)[-_.:m]?([0-5]\d)(?!\d)"
_STAMP = re.compile(_DAY + "[ T_.-]{0,2}" + _CLOCK)
"""A date and a time of day in a name."""


class Facts(NamedTuple):
    """What a file says of its time.

    shape    what all parts of a recording have in common
    begins   s, its first stamp on the container's scale; lasts: s; frame: s
    code     s since midnight of its first label, and by what; None where it has no time code
    created  s since 1970 of its beginning (or its end), by its header or its name; None where neither says
    size     bytes
    """

    shape: tuple[object, ...]
    begins: float
    lasts: float
    frame: float
    code: tuple[float, str] | None
    created: float | None
    size: int


class Series(NamedTuple):
    """Recordings whose names count on.

    goes_on   whether each goes on where the one before it ends; None where nothing says
    why       by what that is known
    """

    recordings: list[Recording]
    goes_on: bool | None
    why: str


def facts_of(path: str) -> Facts | None:
    """What the file says; None where it cannot be opened or does not say how long it is."""
    from vidtrack.video.container import open_container, picture_stream
    from vidtrack.video.reader import open_video

    try:
        with open_container(path) as container:
            stream, _ = picture_stream(container, path)
            lasts = stream.duration and stream.duration * stream.time_base
            lasts = lasts or (container.duration and container.duration / 1e6)
            stated = container.metadata.get("creation_time") or stream.metadata.get("creation_time")
        with open_video(path) as video:
            info = video.info
    except VidtrackError:
        return None
    if not lasts or info.is_still:
        return None
    code = (float(info.time.seconds(0.0)), str(info.time.source)) if info.time.anchors else None
    shape = (info.codec, info.width, info.height, info.bits, info.rate)
    created = _moment(os.path.basename(path)) or _moment(stated or "")
    frame, size = float(1 / info.rate), os.stat(path).st_size
    return Facts(shape, float(info.start), float(lasts), frame, code, created, size)


def _moment(text: str) -> float | None:
    """s since 1970 of a date and time in a text, as UTC; None where there is none."""
    found = _STAMP.search(text)
    try:
        return datetime.fromisoformat("{}-{}-{}T{}:{}:{}+00:00".format(*found.groups())).timestamp() if found else None
    except ValueError:
        return None


def goes_on(a: Facts, b: Facts) -> tuple[bool | None, str]:
    """Whether b goes on where a ends, and by what that is known; None where nothing says."""
    if a.shape != b.shape:
        return False, "their pictures differ"
    room = LIMITS.frames * a.frame
    if a.code and b.code and a.code[1] == b.code[1] and a.code[0] != b.code[0]:
        return abs(b.code[0] - a.code[0] - a.lasts) <= room, "time code"
    if abs(b.begins - a.begins) > room:
        if abs(b.begins - a.begins - a.lasts) <= room:
            return True, "time stamps that run on"
        return None, ""
    if a.created is not None and b.created is not None and a.created != b.created:
        between = b.created - a.created
        return min(abs(between - a.lasts), abs(between - b.lasts)) <= LIMITS.created, "times of creation"
    return None, ""


def series_among(recordings: Sequence[Recording], facts: Callable[[str], Facts | None]) -> list[Series]:
    """Videos whose names count on, with what is known of them; those that are surely recordings of their own left out.

    facts   of a path, as `facts_of` gives them
    """
    found = []
    for alike in _counting(recordings):
        run: list[Recording] = [alike[0]]
        why: list[tuple[bool | None, str]] = []
        for a, b in pairwise(alike):
            one, other = facts(a.parts[-1]), facts(b.parts[0])
            how = goes_on(one, other) if one and other else (None, "")
            if how[0] is None and not _may_be_part(a, one):
                how = (False, "")
            if why and how[0] is not why[-1][0]:  # a series is of one mind
                found += _series(run, why)
                run, why = [a], []
            run.append(b)
            why.append(how)
        found += _series(run, why)
    return found


def _series(run: list[Recording], why: list[tuple[bool | None, str]]) -> list[Series]:
    if not why or why[0][0] is False:
        return []
    return [Series(list(run), why[0][0], why[0][1])]


def _may_be_part(recording: Recording, facts: Facts | None) -> bool:
    """Whether a file may go on in the next one though nothing says so: by its name, or because it is full."""
    stem = os.path.splitext(os.path.basename(recording.path))[0]
    full = facts is not None and any((1 - LIMITS.share) * f <= facts.size <= 1.001 * f for f in LIMITS.full)
    return full or _PART.search(stem) is not None


def _counting(recordings: Iterable[Recording]) -> list[list[Recording]]:
    """Videos of one folder, two or more each, whose names are alike but for dates and a number that counts by one."""
    alike: dict[tuple[str, str], list[Recording]] = {}
    for recording in recordings:
        if recording.kind == "video" and re.search(r"\d", os.path.basename(recording.path)):
            folder, name = os.path.split(recording.path)
            alike.setdefault((folder, re.sub(r"\d+", "#", name.casefold())), []).append(recording)
    found = []
    for own in alike.values():
        by_name = {os.path.basename(r.path): r for r in own}
        chain: list[Recording] = []
        for recording in [by_name[name] for name in in_order(by_name)]:
            if chain and not _counts_on(chain[-1].path, recording.path):
                found.append(chain)
                chain = []
            chain.append(recording)
        found.append(chain)
    return [chain for chain in found if len(chain) > 1]


def _counts_on(before: str, after: str) -> bool:
    a, b = (re.findall(r"\d+", os.path.basename(path)) for path in (before, after))
    other = [(x, y) for x, y in zip(a, b, strict=True) if x != y]
    counters = [int(y) - int(x) == 1 for x, y in other if len(x) < 6]
    return all(counters) and len(counters) <= 1 and bool(other)


def joined_where(recordings: Sequence[Recording], chosen: Iterable[Sequence[Recording]]) -> list[Recording]:
    """The recordings with each chosen series as one: those that overlap are one series."""
    chains: list[list[Recording]] = []
    for series in chosen:
        if chains and chains[-1][-1] == series[0]:
            chains[-1] += series[1:]
        else:
            chains.append(list(series))
    inside = {part.path for chain in chains for part in chain}
    whole = [
        Recording(chain[0].path, tuple(path for part in chain for path in part.parts), "chapters") for chain in chains
    ]
    return sorted([*(r for r in recordings if r.path not in inside), *whole], key=lambda r: r.path)


def wished_together(recordings: Sequence[Recording], patterns: Sequence[str]) -> list[list[Recording]]:
    """The recordings that a person wants as one: found by a pattern, their names alike but for the last number."""
    found = []
    for pattern in patterns:
        alike: dict[tuple[str, str], dict[str, Recording]] = {}
        for recording in recordings:
            folder, name = os.path.split(recording.path)
            path = recording.path.replace(os.sep, "/")
            if recording.kind != "still" and (fnmatch.fnmatch(path, pattern) or fnmatch.fnmatch(name, pattern)):
                stem, ending = os.path.splitext(name.casefold())
                alike.setdefault((folder, re.sub(r"\d+(?=\D*$)", "#", stem) + ending), {})[name] = recording
        chains = [[own[name] for name in in_order(own)] for own in alike.values()]
        if not any(len(chain) > 1 for chain in chains):
            raise VidtrackError(
                f"--join {pattern}: finds no files whose names differ in a number alone. Correct the pattern."
            )
        found += [chain for chain in chains if len(chain) > 1]
    return found

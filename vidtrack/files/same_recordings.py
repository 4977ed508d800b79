"""One recording that lies under the names of two cameras, or of two runs: a file that was copied to the wrong place.

Two cameras that share their calibration recordings as well look through one lens (by mirrors); a run all of whose
recordings are those of another is that run once more, with other settings. Neither is a mistake.
"""

from __future__ import annotations

import filecmp
import hashlib
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations

from vidtrack.files.experiment import Experiment, within
from vidtrack.settings.config import Settings

LEAST_BYTES = 4096
"""A file of less is no recording: two may well be alike."""

_ENDS = 1 << 16  # a picture of DV is longer
"""Bytes at both ends of a file, by which nearly all that differ do."""


def check_same_recordings(settings: Settings, experiment: Experiment) -> list[str]:
    """Which recordings are the same that cannot be, a line each."""
    problems = []
    runs = {name: _films(settings, experiment, name) for name in experiment.runs}
    clips = [clip.videos for clip in experiment.clips.values()]
    which = _contents([path for films in runs.values() for path in films.values()])
    if len(set(which.values())) == len(which):
        return []
    which |= _contents([path for films in clips for path in films.values() if os.path.isfile(path)])

    def one_lens(one: str, other: str) -> bool:
        both = [films for films in clips if one in films and other in films]
        return bool(both) and all(which.get(own[one], one) == which.get(own[other], other) for own in both)

    own = {name: {camera: which[path] for camera, path in films.items()} for name, films in runs.items()}
    for name, films in own.items():
        problems += [
            f"{within(experiment.folder, 'runs', name)}: the recordings of {one} and {other} are the same, byte by "
            "byte: one was copied to the place of the other. Put each camera's own there."
            for one, other in combinations(films, 2)
            if films[one] == films[other] and not one_lens(one, other)
        ]
    for (first, a), (second, b) in combinations(own.items(), 2):
        common = [camera for camera in a if camera in b]
        same = [camera for camera in common if a[camera] == b[camera]]
        place = within(experiment.folder, "runs", second)
        if same and len(same) < len(common):
            problems.append(
                f"{place}: the recording of {' and '.join(same)} is that of run {first}, byte by byte, and those of "
                "the other cameras are not. Put the run's own there."
            )
        problems += [
            f"{place}: the recording of {two} is that of {one} in run {first}, byte by byte. Put its own there."
            for one in a
            for two in b
            if one != two and a[one] == b[two] and not one_lens(one, two)
        ]
    return problems


def _films(settings: Settings, experiment: Experiment, name: str) -> Mapping[str, str]:
    """The recordings of a run that are a file of a camera alone: no tracks, pictures or streams of a common file."""
    run, own = experiment.runs[name], settings.runs.get(name)
    stream = own.stream if own else None
    return {
        camera: path
        for camera, path in run.videos.items()
        if camera not in run.tracks
        and not (camera in run.recordings and run.recordings[camera].numbered)
        and not (isinstance(stream, dict) and camera in stream)
        and os.path.isfile(path)
    }


def _contents(paths: Sequence[str]) -> dict[str, str]:
    """Of each file the path of the first one that holds the same bytes; links to one file are not read to see it."""
    states = {path: os.stat(path) for path in paths}
    firsts: dict[tuple[int, int], str] = {}
    linked = {path: firsts.setdefault((state.st_dev, state.st_ino), path) for path, state in states.items()}
    count = Counter(states[path].st_size for path in firsts.values())
    kinds: dict[tuple[int, bytes], list[str]] = {}
    out = {}
    for path, first in linked.items():
        out[path] = path
        if (size := states[path].st_size) < LEAST_BYTES:
            continue
        if first != path:
            out[path] = out[first]
            continue
        if count[size] < 2:
            continue
        alike = kinds.setdefault((size, _ends(path, size)), [])
        same = next((other for other in alike if filecmp.cmp(path, other, shallow=False)), None)
        if same is None:
            alike.append(path)
        out[path] = same or path
    return out


def _ends(path: str, size: int) -> bytes:
    with open(path, "rb") as file:
        first = file.read(_ENDS)
        file.seek(max(0, size - _ENDS))
        return hashlib.sha256(first + file.read(_ENDS)).digest()

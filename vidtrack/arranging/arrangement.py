"""Which camera, which calibration clip and which run each recording is, by folders and names.

People keep a folder a camera, a folder a test, or everything in one place with the camera in the name. Every level of
folders and every word of the names is tried as the place of the camera: the best is that by which each take (what is
left of the path) has all cameras, and whose words look like cameras.
"""

from __future__ import annotations

import fnmatch
import os
import re
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from vidtrack.arranging.inventory import Recording
from vidtrack.arranging.times_in_names import LIMITS, STAMP, one_time_a_take
from vidtrack.naming import chapter_of

CAMERA = re.compile(
    r"(cam(era)?|kamera|gopro|view|channel|ch|c|k|v)[ _-]?\d+|(cam(era)?|kamera)[ _-]?[a-z]+|left|right|top|bottom"
    r"|front|back|rear|side|above|north|south|east|west|port|starboard|links|rechts|l|r",
    re.IGNORECASE,
)
"""Words that name a camera."""

COUNTER = re.compile(r"c\d{4}", re.IGNORECASE)
"""How Sony's cameras count their recordings: C0001 is a take, C1 a camera."""

CALIBRATION = re.compile(
    r".*(calib|kalib|survey|wand|checker|grid|dots|balls|points).*|cal\d*|row\d*|target[ _-]?plate", re.IGNORECASE
)
"""Words that name a calibration clip."""

GENERIC = frozenset("videos video recordings recording media runs run tests test footage clips clip data".split())  # noqa: SIM905
"""Words of folders that say nothing of what was filmed."""

CARD = re.compile(
    r"dcim|private|avchd|bdmv|stream|m4root|mp_root|xdroot|contents|\d{3}(gopro|media|canon|msdcf|_pana|nikon|olymp)"
)
"""Folders that cameras make on their cards, in small letters."""

MOST_CAMERAS = 16
"""More are no cameras but takes."""


class Take(NamedTuple):
    """What was filmed once: by camera, its recording. kind: calibration | run."""

    name: str
    kind: str
    recordings: Mapping[str, Recording]


class Arrangement(NamedTuple):
    """What is proposed.

    cameras   names, in order
    takes     calibration clips and runs, in order of their names
    left      recordings that fit in nowhere, and why
    notes     how it was decided, where a person should look again
    """

    cameras: list[str]
    takes: list[Take]
    left: list[tuple[Recording, str]]
    notes: list[str]

    def of(self, kind: str) -> list[Take]:
        """The calibration clips, or the runs."""
        return [take for take in self.takes if take.kind == kind]


Split = dict[str, tuple[str, list[str]]]
"""By path: the word of the camera, and the words of the take."""


class Wishes(NamedTuple):
    """What a person said: name and pattern of paths, each."""

    cameras: Sequence[tuple[str, str]] = ()
    clips: Sequence[tuple[str, str]] = ()
    runs: Sequence[tuple[str, str]] = ()


NO_WISHES = Wishes()


def arranged(recordings: Sequence[Recording], wishes: Wishes = NO_WISHES) -> Arrangement:
    """The arrangement that the paths of recordings suggest; what a person wishes counts before it."""
    if not recordings:
        return Arrangement([], [], [], [])
    notes: list[str] = []
    others = [r for r in recordings if as_laid_out(r) is None]
    guess = _guess(others, notes) if others else None
    cameras: dict[str, None] = {}
    takes: dict[tuple[str, str], dict[str, Recording]] = defaultdict(dict)
    left: list[tuple[Recording, str]] = []
    for recording in sorted(recordings, key=lambda r: as_laid_out(r) is None):
        laid = as_laid_out(recording)
        camera, words = laid or (guess(recording) if guess else ("", []))
        camera = _wished(recording, wishes.cameras) or camera
        clip, run = _wished(recording, wishes.clips), _wished(recording, wishes.runs)
        kind = "calibration" if clip or (not run and _is_calibration(words, recording)) else "run"
        name = clip or run or (words[1] if laid else _take_name(words, kind))
        own = takes[kind, name]
        if camera in own:
            left.append((recording, f"{kind} {name} has {own[camera].path} for {camera} already"))
        else:
            own[camera] = recording
            cameras.setdefault(camera)
    ordered = [Take(name, kind, dict(sorted(own.items()))) for (kind, name), own in sorted(takes.items())]
    return Arrangement(sorted(cameras), ordered, left, notes)


def as_laid_out(recording: Recording) -> tuple[str, list[str]] | None:
    """The camera and the take of a recording that lies where an experiment folder has it."""
    parts = recording.path.split(os.sep)
    several = len(recording.parts) > 1
    if parts[0] not in ("calibration", "runs") or len(parts) not in ((3, 4) if several else (3,)):
        return None
    camera = parts[2] if len(parts) == 4 else os.path.splitext(parts[2])[0]
    if several and len(parts) == 3:  # cam1_1.mov, cam1_2.mov
        camera = re.sub(r"[ _.\-(]{1,3}\d{1,12}\)?$", "", camera)
    return (camera, parts[:2]) if camera == clean(camera) and parts[1] == clean(parts[1]) else None


def _guess(recordings: Sequence[Recording], notes: list[str]) -> Callable[[Recording], tuple[str, list[str]]]:
    """A function from a recording to its camera and the words of its take."""
    parts = _without_common_folder({r.path: _parts(r) for r in recordings})
    best = _best_place(parts)
    single = all(len(r.parts) == 1 for r in recordings)
    timed = single and one_time_a_take({r.path: os.path.split(os.path.splitext(r.path)[0]) for r in recordings})
    if timed:
        by_time = _without_common_folder({r.path: _parts(r, timed[r.path]) for r in recordings})
        together = _best_place(by_time)
        if together and (best is None or best[0] < together[0] - 0.1):
            parts, best = by_time, together
            notes.append(
                f"recordings that begin within {LIMITS.together_s:g} s of each other, by the times in their names, are "
                "taken as one run or clip: look whether that is right"
            )
    paired = _by_order(recordings)
    if paired and (best is None or best[0] < _score(list(paired.values())) - 0.3):
        notes.append("recordings were paired between cameras by the order of their names: look whether that is right")
        return lambda r: _named(*paired[r.path])
    if best is None or best[0] < 0:
        notes.append("no camera is named in the paths: each recording is taken as a run of one camera, cam1")
        return lambda r: ("cam1", parts[r.path])
    known = best[1]
    return lambda r: _named(*known[r.path])


def _best_place(parts: Mapping[str, list[str]]) -> tuple[float, Split] | None:
    """The place of the camera that fits best, and how well."""
    depth = max(len(p) for p in parts.values())
    best: tuple[float, Split] | None = None
    for at in (*range(-depth, depth), None):
        split = {path: _without(p, at) for path, p in parts.items()}
        known = {path: s for path, s in split.items() if s is not None}
        if len(known) == len(split):
            score = _score(list(known.values()))
            if best is None or score > best[0] + 1e-9:
                best = score, known
    return best


def _parts(recording: Recording, stem: str | None = None) -> list[str]:
    """Folders, and the words of the name, or of another `stem`; of numbered pictures the number is left out."""
    folder, name = os.path.split(recording.path)
    given, stem = stem, os.path.splitext(name)[0]
    if given is not None:
        stem = given
    elif recording.kind == "pictures":
        stem = re.sub(r"\d+$", "", stem)
    elif chapter := chapter_of(name):
        stem = f"G{chapter[0]}"
    elif recording.kind == "chapters":
        stem = _without_counter([os.path.splitext(os.path.basename(part))[0] for part in recording.parts]) or stem
    words = [w for w in re.split(r"[ _.\-]+", stem) if w]
    joined: list[str] = []
    for word in words:  # camera_2 is one word, run 1 too
        counted = word.isdigit() and joined and re.fullmatch(r"run|test|take|trial", joined[-1], re.IGNORECASE)
        if counted or (joined and re.fullmatch(r"cam(era)?|kamera|gopro|view", joined[-1], re.IGNORECASE)):
            joined[-1] += word
        else:
            joined.append(word)
    folders = [part for part in folder.split(os.sep) if folder and not CARD.fullmatch(part.casefold())]
    return [*folders, *joined]


def _without_counter(stems: Sequence[str]) -> str:
    """What the names of a recording's parts have in common, without the number that counts them from 0 or 1 on."""
    pieces = [re.split(r"(\d+)", stem) for stem in stems]
    if len({len(own) for own in pieces}) > 1:
        return ""
    first = pieces[0]
    for k in range(len(first) - 2, 0, -2):  # the last number that counts
        own = [int(piece[k]) for piece in pieces]
        if own[0] in (0, 1) and own == list(range(own[0], own[0] + len(own))):
            rest = "".join([*first[:k], *first[k + 1 :]])
            return re.sub(r"[ _.\-(]*(part|teil|chapter|chap|reel|pt)?[ _.\-()]*$", "", rest, flags=re.IGNORECASE)
    return ""


def _without_common_folder(parts: Mapping[str, list[str]]) -> Mapping[str, list[str]]:
    """Words without the folders that all recordings lie in, as far as a camera and a take remain: they name neither."""
    (first, *_), folders = parts.values(), [path.split(os.sep)[:-1] for path in parts]
    for level, name in enumerate(first):
        shared = all(own[level : level + 1] == [name] for own in folders)
        if not shared or CAMERA.fullmatch(name) or CALIBRATION.fullmatch(name) or len(parts) < 2:
            break
        if any(len(own) < 3 for own in parts.values()):
            break
        parts = {path: own[1:] for path, own in parts.items()}
    return parts


def _looks_like_camera(word: str) -> bool:
    """Whether a word of a path, or one part of it (sony-left, Pool North), names a camera."""
    words = [word, *(re.split(r"[ _.\-]+", word) if len(word) > 4 else [])]
    return any(CAMERA.fullmatch(own) and not COUNTER.fullmatch(own) for own in words)


def _without(parts: Sequence[str], at: int | None) -> tuple[str, list[str]] | None:
    """The word at a place, None: the only one that looks like a camera, and the others."""
    if at is None:
        found = [i for i, word in enumerate(parts) if _looks_like_camera(word)]
        if len(found) != 1:
            return None
        at = found[0]
    if not -len(parts) <= at < len(parts):
        return None
    rest = list(parts)
    return rest.pop(at), rest


def _score(split: Sequence[tuple[str, list[str]]]) -> float:
    """How well a place of the camera fits: the share of cameras that each take has, and whether they look like it."""
    values = {camera.casefold() for camera, _ in split}
    takes: dict[tuple[str, ...], set[str]] = defaultdict(set)
    for camera, rest in split:
        takes[tuple(rest)].add(camera.casefold())
    if len(values) > MOST_CAMERAS or sum(map(len, takes.values())) < len(split):
        return -2.0
    looks = sum(_looks_like_camera(v) for v in values) / len(values)
    wrong = sum(bool(CALIBRATION.fullmatch(v) or STAMP.fullmatch(v)) or v in GENERIC for v in values) / len(values)
    whole = sum(map(len, takes.values())) / (len(takes) * len(values))
    if len(values) == 1:
        return looks - 1.5 * wrong - 0.5
    return whole + looks - 1.5 * wrong - 0.01 * len(values) - (0.6 if whole < 0.5 else 0)


def _by_order(recordings: Sequence[Recording]) -> dict[str, tuple[str, list[str]]] | None:
    """A folder a camera with names that have nothing in common: the first of each belong together."""
    folders: dict[tuple[str, str], list[Recording]] = defaultdict(list)
    for recording in recordings:
        parts = [p for p in os.path.dirname(recording.path).split(os.sep) if p and not CARD.fullmatch(p.casefold())]
        if not parts:
            return None
        camera = next((p for p in parts if _looks_like_camera(p)), parts[0])
        rest = [p for p in parts if p != camera]
        folders[camera, os.sep.join(rest)].append(recording)
    by_rest: dict[str, dict[str, list[Recording]]] = defaultdict(dict)
    for (camera, kind), own in folders.items():
        by_rest[kind][camera] = own
    answer: dict[str, tuple[str, list[str]]] = {}
    for kind, cameras in by_rest.items():
        counts = {len(own) for own in cameras.values()}
        if len(counts) != 1 or len(cameras) < 2:
            return None
        for camera, own in cameras.items():
            for i, recording in enumerate(sorted(own, key=lambda r: (r.kind == "still", r.path))):
                stem = os.path.splitext(os.path.basename(recording.path))[0]
                named = stem if CALIBRATION.fullmatch(stem) else f"take{i + 1}"
                answer[recording.path] = camera, [*filter(None, kind.split(os.sep)), named]
    return answer


def _named(camera: str, words: list[str]) -> tuple[str, list[str]]:
    camera = clean(camera)
    return (f"cam{camera}" if camera.isdigit() else camera), words


def clean(word: str) -> str:
    """A word as a name in config.yaml may be: letters, digits, _ . -, beginning with a letter or digit."""
    return re.sub(r"[^\w.-]+", "_", word).strip("_.-") or "x"


def _wished(recording: Recording, wishes: Sequence[tuple[str, str]]) -> str | None:
    path = recording.path.replace(os.sep, "/")
    for name, pattern in wishes:
        if fnmatch.fnmatch(path, pattern) or fnmatch.fnmatch(os.path.basename(path), pattern):
            return name
    return None


def _is_calibration(words: Sequence[str], recording: Recording) -> bool:
    if words and words[0].casefold() == "runs":
        return False
    return recording.kind == "still" or any(CALIBRATION.fullmatch(w) for w in words)


def _take_name(words: Sequence[str], kind: str) -> str:
    naming = list(dict.fromkeys(w for w in words if w.casefold() not in GENERIC))  # drop1/drop1_0001.tif
    if kind == "calibration":
        naming = [w for w in naming if w.casefold() != "calibration"] or naming
    return clean("-".join(naming)) if naming else ("clip1" if kind == "calibration" else "run1")

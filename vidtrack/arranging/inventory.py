"""What recordings lie in a folder: files, numbered pictures that are one recording, chapters of one recording."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from vidtrack.files.beside import LITTER, is_recording
from vidtrack.naming import chapter_of, in_order

OUTPUT = frozenset({"results", ".snakemake", "sensitivity"})
"""Folders of an experiment that hold no recordings."""

PICTURES = frozenset("bmp jpeg jpg jp2 png pgm ppm tif tiff heic heif webp".split())  # noqa: SIM905
"""Endings of single pictures."""

SEQUENCE = 5
"""Pictures in one folder that differ by a number alone, at least, to be one recording."""

_NUMBERED = re.compile(r"(.*?)(\d+)(\.[^.]+)")


class Recording(NamedTuple):
    """One recording.

    path    relative to the folder, of the file or of its first part
    parts   all its files, in order: one, or the chapters or numbered pictures of one recording
    kind    video | still | pictures | chapters
    """

    path: str
    parts: tuple[str, ...]
    kind: str


def recordings_in(folder: str) -> list[Recording]:
    """All recordings below a folder, by path, without results and what systems leave behind."""
    found: list[Recording] = []
    for here, folders, names in os.walk(folder):
        folders[:] = sorted(n for n in folders if not LITTER.fullmatch(n) and not (here == folder and n in OUTPUT))
        names = sorted(n for n in names if not LITTER.fullmatch(n) and is_recording(n))
        place = os.path.relpath(here, folder)
        found += joined(names, "" if place == os.curdir else place)
    return _each_once(folder, sorted(found, key=lambda r: r.path))


def _each_once(folder: str, found: Sequence[Recording]) -> list[Recording]:
    """Recordings without second names of the same file: of a link and its file, what lies in the contract's place."""
    first: dict[str, Recording] = {}
    for recording in found:
        real = os.path.realpath(os.path.join(folder, recording.path))
        if real not in first or recording.path.split(os.sep)[0] in ("calibration", "runs"):
            first[real] = recording
    return [recording for recording in found if recording in first.values()]


def joined(names: Iterable[str], place: str = "") -> list[Recording]:
    """The recordings that the files of one folder are."""
    names = list(names)
    groups: dict[tuple[str, ...], list[str]] = {}
    for name in names:
        groups.setdefault(_group(name), []).append(name)
    found = []
    for key, own in groups.items():
        if key[0] == "pictures" and len(own) < SEQUENCE:
            found += [_recording(place, [name], "still") for name in own]
        elif key[0] == "chapters" and len(own) > 1:
            found.append(_recording(place, in_order(own), "chapters"))
        elif key[0] == "pictures":
            ordered = sorted(own, key=lambda n: (len(n), n))
            found.append(_recording(place, ordered, "pictures"))
        else:
            found += [_recording(place, [name], "still" if _is_picture(name) else "video") for name in own]
    return found


def _group(name: str) -> tuple[str, ...]:
    if chapter := chapter_of(name):
        return "chapters", name[:2].lower().replace("go", "gp"), chapter[0]
    numbered = _NUMBERED.fullmatch(name) if _is_picture(name) else None
    if numbered:
        return "pictures", numbered[1], numbered[3].lower()
    return "one", name


def _is_picture(name: str) -> bool:
    return os.path.splitext(name)[1].lower().removeprefix(".") in PICTURES


def _recording(place: str, names: Sequence[str], kind: str) -> Recording:
    parts = tuple(os.path.join(place, name) for name in names)
    return Recording(parts[0], parts, kind)

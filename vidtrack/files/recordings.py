"""The recordings of a folder by camera, in however many files: one, chapters, numbered pictures, a folder a camera."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from typing import NamedTuple

from vidtrack.errors import first_of
from vidtrack.files.beside import (
    STILLS,
    broken_link,
    entries,
    is_recording,
    may_be_recording,
    unknown_camera,
)
from vidtrack.naming import chapter_of, did_you_mean, in_one_form, in_order, numbered_like


class Recording(NamedTuple):
    """The files of one recording.

    path      the first
    others    those that go on where it ends, or that are numbered on from it
    numbered  whether each is one picture
    """

    path: str
    others: tuple[str, ...] = ()
    numbered: bool = False

    @property
    def files(self) -> tuple[str, ...]:
        """All of them, in order."""
        return (self.path, *self.others)

    @property
    def parts(self) -> list[str]:
        """The files that go on where the first ends, as paths from its folder; none for numbered pictures."""
        folder = os.path.dirname(self.path) or "."
        return [] if self.numbered else [os.path.relpath(path, folder) for path in self.others]


def recordings_in(folder: str, cameras: Sequence[str], problems: list[str]) -> dict[str, Recording]:
    """A folder's recordings by camera; what is wrong goes to `problems`, a line each.

    cam1.mov is camera cam1's; so are cam1_1.mov and cam1_2.mov, the pictures cam1_0001.png and on, and what lies in a
    folder cam1. A file of unknown ending is a recording only if the camera has no other.
    """
    found: dict[str, Recording] = {}
    unknown: list[str] = []
    here = entries(folder)
    files = [name for name in here if not os.path.isdir(_in(folder, name)) and may_be_recording(name)]
    files.sort(key=lambda name: (not is_recording(name), name))
    numbered: dict[str, list[str]] = {}
    for name in files:
        camera, path = in_one_form(os.path.splitext(name)[0]), _in(folder, name)
        if camera not in cameras and (whose := _numbered_for(camera, cameras)) and is_recording(name):
            numbered.setdefault(whose, []).append(name)
        elif camera not in cameras:
            if is_recording(name) or did_you_mean(camera, cameras):
                unknown.append(unknown_camera(path, camera, list(cameras)))
        elif trouble := broken_link(path):
            problems.append(trouble)
        elif camera not in found:
            found[camera] = Recording(path)
        elif is_recording(name):
            problems.append(f"{path}: camera {camera} has another recording here, {found[camera].path}. Keep one.")
    for camera, names in numbered.items():
        if camera in found:
            unknown.append(
                f"{_in(folder, names[0])}: camera {camera} has another recording here, {found[camera].path}. Keep one; "
                f"or, where one goes on where the other ends, name them {camera}_1, {camera}_2."
            )
        elif one := joined(folder, names, problems):
            found[camera] = one
    for name in here:
        if name in cameras and os.path.isdir(_in(folder, name)) and (one := of_folder(_in(folder, name), problems)):
            if name in found:
                problems.append(
                    f"{one.path}: camera {name} has another recording here, {found[name].path}. Keep one of them."
                )
            else:
                found[name] = one
    problems += first_of(unknown, folder)
    return dict(sorted(found.items()))


def of_folder(folder: str, problems: list[str]) -> Recording | None:
    """The one recording in a folder; None, with a problem, where there is none or more than one."""
    names = [name for name in entries(folder) if not os.path.isdir(_in(folder, name)) and is_recording(name)]
    if not names:
        problems.append(f"{folder}: no recording in this folder. Put one there, or remove the folder.")
        return None
    return joined(folder, names, problems)


def inner_folders(folder: str) -> list[str]:
    """The folders within a folder that hold recordings."""
    inner = [name for name in (entries(folder) if os.path.isdir(folder) else ()) if os.path.isdir(_in(folder, name))]
    return [name for name in inner if any(map(is_recording, entries(_in(folder, name))))]


def of_pattern(pattern: str, problems: list[str], place: str) -> Recording | None:
    """The recording in the files that a pattern with * and ? finds; None, with a problem, where it finds none."""
    import fnmatch

    folder, name = os.path.split(pattern)
    folder = folder or os.curdir
    names = fnmatch.filter(entries(folder), name) if os.path.isdir(folder) else []
    if not names:
        problems.append(f"{place}: no file is named as {pattern}. Correct the pattern (relative to the experiment).")
        return None
    return joined(folder, names, problems)


def joined(folder: str, names: Sequence[str], problems: list[str]) -> Recording | None:
    """Files as one recording, in the order of their numbers; None, with a problem, where they are several."""
    names = in_order(names)
    endings = {os.path.splitext(name)[1].lower() for name in names}
    paths = [_in(folder, name) for name in names]
    troubles = [trouble for path in paths if (trouble := broken_link(path))]
    problems += first_of(troubles, folder)
    if troubles:
        return None
    if len(names) == 1:
        return Recording(paths[0])
    if len(endings) > 1:
        problems.append(f"{folder}: files of several kinds ({', '.join(names[:4])}). Keep those of one recording.")
        return None
    if endings <= {f".{ending}" for ending in STILLS}:
        same = {name for _, name in numbered_like(names[0], names)}
        if odd := [name for name in names if name not in same]:
            problems.append(
                f"{folder}: {odd[0]} is not numbered as {names[0]} is. Keep the pictures of one recording there."
            )
            return None
        return Recording(paths[0], tuple(paths[1:]), numbered=True)
    chapters = {chapter[0] for name in names if (chapter := chapter_of(name))}
    if len(chapters) > 1:
        problems.append(
            f"{folder}: chapters of {len(chapters)} recordings ({', '.join(sorted(chapters)[:4])}). Keep those of one."
        )
        return None
    return Recording(paths[0], tuple(paths[1:]))


def _numbered_for(stem: str, cameras: Sequence[str]) -> str | None:
    """The camera whose recording goes on in a file of this name without its ending; the longest name that fits."""
    fits = [c for c in cameras if stem.startswith(c) and re.fullmatch(r"[ _.\-(]{1,3}\d{1,12}\)?", stem[len(c) :])]
    return max(fits, key=len, default=None)


def _in(folder: str, name: str) -> str:
    return os.path.normpath(os.path.join(folder, name))

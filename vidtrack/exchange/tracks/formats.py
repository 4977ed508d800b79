"""Which program a file of tracks is of, and its tracks."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, bytes_of, some, text_of
from vidtrack.exchange.thesis.tracks import CODE_RATE, looks_like_tracks, read_taped
from vidtrack.exchange.tracks import deeplabcut, dltdv, dltdv_sparse, osp_tracker, sleap, trackmate, trackpy
from vidtrack.exchange.tracks.digitised import Convention, Digitised
from vidtrack.exchange.tracks.table import Table, split
from vidtrack.exchange.xml import parsed

HDF5 = b"\x89HDF\r\n\x1a\n"


def read_tracks(path: Path, said: Convention, where: str) -> Digitised:
    """The tracks in a file of any format that is known; VidtrackError, one line, for what cannot be read.

    said    what the config says of the file; where: its place in config.yaml, for messages
    """
    try:
        return _read(path, said, where)
    except (ValueError, ArithmeticError, LookupError, TypeError, EOFError, MemoryError) as error:  # damaged, or hostile
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise VidtrackError(f"{path}: holds no tracks that can be read ({reason}). Export it again.") from None


def _read(path: Path, said: Convention, where: str) -> Digitised:
    content = bytes_of(path)
    head = content[:512]
    if head.startswith(HDF5):
        return _checked(path, _of_h5(path, said, where))
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return _checked(path, _of_xml(path))
    text = text_of(path, content)
    if looks_like_tracks(text):
        return _checked(path, _taped(path))
    if dltdv_sparse.is_sparse(text):
        return _checked(path, dltdv_sparse.read(path, text, said, where))
    if (named := osp_tracker.named_table(text)) is not None:
        return _checked(path, osp_tracker.read_table(path, named[1], named[0]))
    (first, *_), table = split(text)
    return _checked(path, _of_table(path, text, first, table, said, where))


def _of_table(path: Path, text: str, first: list[str], table: Table, said: Convention, where: str) -> Digitised:
    if deeplabcut.is_header(first):
        return deeplabcut.read(path, text, said, where)
    readers: tuple[tuple[Callable[[list[str]], bool], Callable[[], Digitised]], ...] = (
        (dltdv.is_header, lambda: dltdv.read(path, table, said, where)),
        (sleap.is_header, lambda: sleap.read(path, table)),
        (trackpy.is_header, lambda: trackpy.read(path, table)),
        (osp_tracker.is_header, lambda: osp_tracker.read_table(path, table)),
    )
    for fits, read in readers:
        if fits(first):
            if twice := [cell for k, cell in enumerate(first) if cell and cell in first[:k]]:
                raise VidtrackError(f"{path}: column {twice[0]} is there twice. Keep one of the two.")
            return read()
    if {"x", "y", "frame"} <= {cell.lower() for cell in first}:
        raise VidtrackError(
            f"{path}: no column particle: these are detections, not tracks. Link them before they are saved, or add "
            "the column: one number for all rows of a target."
        )
    raise VidtrackError(
        f"{path}: its columns ({some(first)}) are of no program that is known: DLTdv, Argus, trackpy, Tracker, SLEAP, "
        "DeepLabCut, anipose, TrackMate or the thesis's. Export from one of them."
    )


def _of_h5(path: Path, said: Convention, where: str) -> Digitised:
    import h5py

    try:
        with h5py.File(os.fspath(path), "r", locking=False) as file:  # a network folder may have no locks
            return sleap.read_h5(path, file) if sleap.is_analysis(file) else deeplabcut.read_h5(path, file, said, where)
    except (OSError, RuntimeError, KeyError) as error:
        raise VidtrackError(f"{path}: not a whole HDF5 file ({str(error)[:80]}). Copy it again.") from None


def _of_xml(path: Path) -> Digitised:
    root = parsed(path)
    if root.tag in ("TrackMate", "Tracks"):
        return trackmate.read(path, root)
    if root.tag == "object" and "tracker" in root.get("class", "").lower():
        return osp_tracker.read_trk(path, root)
    raise VidtrackError(f"{path}: XML of no program that is known ({root.tag}). TrackMate's and Tracker's are read.")


def _taped(path: Path) -> Digitised:
    taped = read_taped(path)
    names = tuple(f"t{k + 1}" for k in range(taped.b.shape[1]))
    notes = []
    if taped.repeated:
        notes.append(
            f"{taped.repeated} samples repeat the one before, as tsbackm writes what it did not find: left out"
        )
    if taped.twice:
        notes.append(f"{taped.twice} samples of moments that were there before are left out")
    return Digitised(
        "thesis",
        names,
        taped.frame - taped.frame[0],
        taped.b,
        len(names) == 1,
        "upper-left",
        (0.0, 0.0),
        code=taped.code,
        rate=CODE_RATE * 1000 / 1001,
        notes=tuple(notes),
    )


def _checked(path: Path, tracks: Digitised) -> Digitised:
    """Refuse what no tracks can be; targets that were never found stay, all NaN."""
    if not np.isfinite(tracks.b).all(-1).any():
        raise VidtrackError(f"{path}: no target has a position in any frame. Export it again.")
    if tracks.frame.min() < 0:
        raise VidtrackError(f"{path}: frame {tracks.frame.min()} is below 0. Correct the frame numbers.")
    return tracks

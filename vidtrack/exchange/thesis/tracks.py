"""Tracks of the old programs: cam1vid.prn (tsbackm's file, edited) and the passes of tc's automatic tracking.

cam1vid.prn   four lines of text that locate skips, then `time-code X Y` (2 decimals, px); X Y of further targets may
              follow. tsbackm writes it without the four lines and under a name that the operator gives (rawpos.txt)
passes        ` Pass n`, a head, then `X Y time-code [time-code]` in whole px, which end with `-1 -1 -1`; several
              passes over one tape follow each other, each begun a frame later. The first time code was read before
              the picture was taken, the second after it: the first one counts

The time code is SMPTE of NTSC tape (30 labels a second, 30000/1001 pictures); its last separator may be any (tsbackm
writes ; for the recorder's point, which does not mean drop-frame). A target that was not found keeps the place of
the sample before: tsbackm prints it again, or 0.00 0.00 where there was none yet. A repeated place is therefore no
measurement unless the target rests, and is left out where it moves. Tape may have been played backwards: rows are
put in order of time.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, lines_of, number
from vidtrack.files.atomic import replacing

_CODE = re.compile(r"(?<![\d:])(\d{1,2}):(\d{2}):(\d{2})\D(\d{2})(?!\d)")
_DECIMALS = re.compile(r"[-+]?\d+[.,]\d\d(?=[-+\d\s]|$)|[-+]?\d+(?:[.,]\d+)?")
CODE_RATE = 30
"""Labels a second."""
MOVES = 0.05
"""px a sample: what moves by more, in the median, does not rest. Five times the last digit."""


class Taped(NamedTuple):
    """Samples in order of time.

    frame     (k,) labels since midnight, 30 a second; code (k,) as HH:MM:SS:FF
    b         (k, n, 2) px, NaN where it was not found
    repeated  samples left out because they repeat the one before; moments: left out because they were there twice
    """

    frame: np.ndarray[tuple[int], np.dtype[np.int64]]
    code: tuple[str, ...]
    b: Array
    repeated: int
    twice: int


def looks_like_tracks(text: str) -> bool:
    """Whether lines of text hold a time code and at least two numbers beside it."""
    rows = [line for line in text[:20_000].split("\n")[:40] if _CODE.search(line)]
    return bool(rows) and all(len(_values(line)) >= 2 for line in rows)


def read_taped(path: Path) -> Taped:
    """Read cam1vid.prn, tsbackm's own file, or the passes of the automatic tracking."""
    frames: list[int] = []
    codes: list[str] = []
    places: list[list[float]] = []
    passes = False
    for i, line in enumerate(lines_of(path)):
        found = _CODE.search(line)
        if not found:
            passes = passes or bool(re.match(r"\s*Pass\s+\d", line))
            if frames and line.strip() and not passes and line.strip(" =-1"):
                raise VidtrackError(f"{path}, line {i + 1}: {line.strip()[:40]!r} is no sample. Take the line out.")
            continue
        h, m, s, f = (int(part) for part in found.groups())
        if h > 23 or m > 59 or s > 59 or f >= CODE_RATE:
            raise VidtrackError(f"{path}, line {i + 1}: {found[0]} is no time code of NTSC tape. Correct the line.")
        values = _values(line)
        if len(values) < 2 or len(values) % 2:
            raise VidtrackError(
                f"{path}, line {i + 1}: {len(values)} numbers beside the time code, not X Y. Correct the line."
            )
        if places and len(values) != len(places[0]):
            raise VidtrackError(
                f"{path}, line {i + 1}: {len(values) // 2} targets, and {len(places[0]) // 2} before. Correct the line."
            )
        frames.append(((h * 60 + m) * 60 + s) * CODE_RATE + f)
        codes.append(f"{h:02d}:{m:02d}:{s:02d}:{f:02d}")
        places.append(values)
    if not frames:
        raise VidtrackError(f"{path}: no line with a time code and X Y. Put cam1vid.prn there, as tsbackm wrote it.")
    b = np.array(places).reshape(len(frames), -1, 2)
    b, repeated = _without_held(b)
    frame = _over_midnight(np.array(frames, np.int64))
    order = np.argsort(frame, kind="stable")
    frame, first = np.unique(frame[order], return_index=True)
    keep = order[first]
    return Taped(frame, tuple(codes[i] for i in keep), b[keep], repeated, len(codes) - len(keep))


def _values(line: str) -> list[float]:
    """The numbers beside the time codes of a line; two that run into each other have two decimals each."""
    found = [number(text) for text in _DECIMALS.findall(_CODE.sub(" ", line))]
    return [value for value in found if value is not None]


def _without_held(b: Array) -> tuple[Array, int]:
    """Places (k, n, 2) without those that only repeat the sample before, in the file's order; how many these were."""
    b = b.copy()
    never = np.logical_and.accumulate((b == 0).all(-1), axis=0)
    b[never] = np.nan
    same = np.zeros(b.shape[:2], bool)
    same[1:] = (b[1:] == b[:-1]).all(-1)
    step = np.abs(np.diff(b, axis=0)).max(-1)
    step = np.where(same[1:], np.nan, step)
    for k in range(b.shape[1]):
        moved = step[np.isfinite(step[:, k]), k]
        if moved.size and np.median(moved) > MOVES and same[:, k].mean() < 0.5:
            b[same[:, k], k] = np.nan
        else:
            same[:, k] = False
    return b, int(same.sum())


def _over_midnight(frame: np.ndarray[tuple[int], np.dtype[np.int64]]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Frames, those after midnight counted on, where the tape runs over it."""
    day = 86_400 * CODE_RATE
    return np.where(frame < frame.max() - day // 2, frame + day, frame)


def write_taped(path: Path, code: Sequence[str], b: Array, description: str = "") -> None:
    """Write cam1vid.prn with four lines of text: samples (k,) of b (k, n, 2), px.

    A sample in which no target was measured is left out; a target that was not measured beside others has the place
    before, or 0 0, as tsbackm prints it.
    """
    known: NDArray[np.bool_] = np.asarray(np.isfinite(b).all(-1))
    rows, held = [], np.zeros(b.shape[1:])
    for i in np.flatnonzero(known.any(-1)).tolist():
        held = np.asarray(np.where(known[i][:, None], b[i], held))
        rows.append(f"{code[i]:>13s}\t\t" + "\t".join(f"{place[0]:7.2f}{place[1]:7.2f}" for place in held))
    head = [description or "centroids", "time code, then X Y of each target", "px", "=" * 40]
    with replacing(path) as file:
        file.write(("\n".join([*head, *rows])).encode())

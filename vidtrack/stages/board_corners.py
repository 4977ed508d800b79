"""Stage board_corners: one camera's clips of a board become a table of where it saw each corner."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_corners import board_seen, why_not
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.timing.frame import Frame

MOST_PICTURES = 150
"""Pictures of a clip that are looked at: a board moves slowly beside the frame rate."""
KEPT = 15
"""Pictures whose median is the background: the board moves, all else stays."""


_NOTHING = pd.DataFrame(
    {"clip": np.array([], object), **{name: np.array([], np.int64) for name in ("frame", "corner")}}
    | {name: np.array([], float) for name in ("Xf", "Yf", "sd")}
)


class BoardCorners(NamedTuple):
    """What the stage gives.

    table       clip, frame, corner, Xf, Yf, sd (px): a row for each corner of each view
    background  (rows, columns) the median of some pictures, levels as stored, in 8 bits
    """

    table: pd.DataFrame
    background: NDArray[np.uint8]
    record: dict[str, Any]
    findings: tuple[Finding, ...]


def stride(longest: int) -> int:
    """Every how many pictures one is searched, in clips of at most so many: a power of two, so that cameras that were
    filmed together look at the same moments."""
    return 1 << max(0, -(-longest // MOST_PICTURES) - 1).bit_length()


def board_corners(
    clips: Mapping[str, Iterable[Frame]],
    boards: Mapping[str, Board],
    *,
    camera: str,
    bits: Mapping[str, int],
    every: int,
) -> BoardCorners:
    """Find the board's corners in every `every`-th picture of each clip.

    A clip that does not show the board has a finding, with the likeliest reason.
    Raises VidtrackError, one line, where no clip has a picture.
    """
    parts, account, findings = [], {}, []
    kept: list[NDArray[np.uint8]] = []
    shape: tuple[int, ...] | None = None
    for clip, frames in clips.items():
        looked = found = 0
        last: NDArray[np.uint8] | None = None
        for frame in frames:
            if frame.index % every or frame.corrupt:
                continue
            picture = np.ascontiguousarray(_eight_bits(frame.luma, bits[clip]))
            if shape is not None and picture.shape != shape:
                raise VidtrackError(
                    f"calibration/{clip}: camera {camera} has pictures of {picture.shape[1]} x {picture.shape[0]} px "
                    f"here, but of {shape[1]} x {shape[0]} before. Use clips of one size."
                )
            shape, last, looked = picture.shape, picture, looked + 1
            if len(kept) < KEPT or looked % 7 == 0:
                kept = [*kept[-KEPT + 1 :], picture]
            seen = board_seen(boards[clip], picture)
            if seen is not None:
                found += 1
                parts.append(
                    pd.DataFrame(
                        {
                            "clip": clip,
                            "frame": frame.index,
                            "corner": seen.ids,
                            "Xf": seen.b[:, 0],
                            "Yf": seen.b[:, 1],
                            "sd": seen.sd,
                        }
                    )
                )
        account[clip] = {"pictures": looked, "with_board": found, "every": every}
        if not found:
            why = why_not(boards[clip], last) if last is not None else "the clip has no picture"
            text = f"calibration/{clip}: camera {camera} shows no {_named(boards[clip])} in {looked} pictures"
            cure = (
                why
                or "is it sharp, lit evenly, wholly in view, with a white margin; and are its type and numbers right"
            )
            findings.append(
                Finding(
                    "bad",
                    "board-not-found",
                    f"{text}: {cure}.",
                    "Correct the board's description, or leave the clip out.",
                )
            )
    if shape is None:
        raise VidtrackError(*(f"{finding.text} {finding.cure}" for finding in findings))
    table = pd.concat(parts, ignore_index=True) if parts else _NOTHING
    record = {"camera": camera, "image_size": [shape[1], shape[0]], "clips": account, "findings": as_records(findings)}
    return BoardCorners(table, np.median(np.stack(kept), axis=0).astype(np.uint8), record, tuple(findings))


def _named(board: Board) -> str:
    return f"{board.type} board of {board.columns} x {board.rows}"


def _eight_bits(luma: NDArray[Any], bits: int) -> NDArray[np.uint8]:
    if luma.dtype == np.uint8:
        return np.asarray(luma)
    return np.asarray(np.clip(luma.astype(np.float32) * (255 / (2**bits - 1)), 0, 255), np.uint8)

"""Pictures that come in a pattern of new ones and repeats: 24 pictures a second in 60 fields (pulldown) or 30 frames.

A conversion codes each repeat anew, so that no two pictures are the same bit by bit, and all cameras that were
converted alike agree. The tracks show it: of every m steps in a row the same ones are none, and the others too long.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding


@dataclass(frozen=True)
class RepeatPattern:
    """When steps come in a pattern.

    longest   steps after which it begins again
    still     of the mean step, what a repeat moves at most (median), and 80 % of its steps
    moves     what each other one moves at least (median)
    noises    standard deviations of a position that a mean step has at least
    fewest    steps of each place in the pattern
    """

    longest: int = 6
    still: tuple[float, float] = (0.25, 0.5)
    moves: float = 1.05
    noises: float = 4.0
    fewest: int = 8


REPEAT_PATTERN = RepeatPattern()


class Pattern(NamedTuple):
    """Of so many samples in a row, so many that are new."""

    length: int
    new: int


def repeat_pattern(where: Array, sd: Array) -> Pattern | None:
    """The pattern in which the tracks (n, targets, 2) px stand still; None where they do not.

    sd  (n, targets, 2) px
    """
    step = np.diff(where, axis=0)
    for m in range(2, REPEAT_PATTERN.longest + 1):
        if len(step) < m * REPEAT_PATTERN.fewest:
            return None
        before = m // 2
        mean = (where[m:] - where[:-m]) / m  # of the m steps about step number `before` and those that follow
        own = step[before : before + len(mean)]
        square = np.square(mean).sum(-1)
        noise = np.square(sd[before : before + len(mean)]).sum(-1)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.where(square > REPEAT_PATTERN.noises**2 * noise, (own * mean).sum(-1) / square, np.nan)
        phase = np.arange(len(share)) % m
        each = [known[np.isfinite(known)] for k in range(m) for known in [share[phase == k].ravel()]]
        if min(known.size for known in each) < REPEAT_PATTERN.fewest:
            continue
        middle = np.array([np.median(known) for known in each])
        still = middle < REPEAT_PATTERN.still[0]
        if not still.any() or still.all() or not (middle[~still] > REPEAT_PATTERN.moves).all():
            continue
        rest = [np.quantile(np.abs(known), 0.8) for known, none in zip(each, still, strict=True) if none]
        if max(rest) < REPEAT_PATTERN.still[1]:
            return Pattern(m, int((~still).sum()))
    return None


def pattern_findings(where: Array, sd: Array, rate: float, fields: bool) -> list[Finding]:
    """What to say of such a pattern; rate: samples a second."""
    pattern = repeat_pattern(where, sd)
    if pattern is None or (fields and pattern.length == 2):  # both fields of one picture are no repeat
        return []
    what = "fields" if fields else "pictures"
    text = (
        f"of every {pattern.length} {what} in a row {pattern.length - pattern.new} show nothing new: "
        f"{rate * pattern.new / pattern.length:.4g} pictures a second were taken and are shown as {rate:.4g} {what} "
        "(pulldown, or another conversion of the rate). Positions in the repeats are those of an earlier moment"
    )
    cure = (
        "Take the recording as the camera wrote it; else undo the conversion (inverse telecine) and give the rate at "
        "which the pictures were taken (rate)."
    )
    return [Finding("bad", "pictures-repeat-in-pattern", text, cure)]

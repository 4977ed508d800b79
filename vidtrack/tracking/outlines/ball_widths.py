"""How wide the targets of a recording look, and pieces of them, at some samples: evenly spread, however long it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.outlines.apparent_width import apparent_widths
from vidtrack.tracking.outlines.ball_outline import Piece, piece_of
from vidtrack.tracking.outlines.lighting import Lighting
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import PIXELS, X, Y


@dataclass(frozen=True)
class Looks:
    """How often targets are looked at, so that it takes a few hundredths of a second a recording.

    targets   at most, evenly chosen
    samples   at most; with several targets fewer: so many looks at all of them together
    apart     px from outline to outline, up to which a neighbour changes how a target's own edge looks
    """

    targets: int = 16
    samples: int = 32
    in_all: int = 192
    apart: float = 5.0


LOOKS = Looks()


class BallWidths:
    """Collects the widths of n targets, and pieces of pictures about them; of twice too many samples every other one is
    forgotten.
    """

    def __init__(self, n: int, detection: Detection) -> None:
        self._who = np.unique(np.linspace(0, n - 1, min(n, LOOKS.targets)).round().astype(np.intp))
        self._detection = detection
        self._most = min(LOOKS.in_all // max(self._who.size, 1), LOOKS.samples)
        self._every = 1
        self._samples: list[int] = []
        self._rows: list[Array] = []  # Xf, Yf, width of each of those targets
        self._pieces: list[list[Piece | None]] = []  # of each of them

    def passed(self, samples: Sequence[Sample], first: int, values: Array) -> None:
        """Look at samples, the first of which has this number; values (MEASURED, samples or more, n or more)."""
        for j, sample in enumerate(samples):
            if (first + j) % self._every or sample.corrupt or sample.repeated or not self._who.size:
                continue
            every = values[[X, Y, PIXELS], j]
            x, y, pixels = every[:, self._who]
            alone = _alone(every, self._who, sample.lines)
            at = np.stack([x, sample.row(y)], -1)
            grey = self._detection.bright(sample.luma)
            scale = self._detection.scale
            widths = apparent_widths(grey, at, pixels, lines=sample.lines, scale=scale)
            self._samples.append(first + j)
            self._rows.append(np.stack([x, y, widths], -1))
            self._pieces.append(
                [
                    piece_of(grey, place, count, lines=sample.lines, scale=scale, shown=(own, first + j))
                    if free
                    else None
                    for place, count, own, free in zip(at, pixels.tolist(), y.tolist(), alone.tolist(), strict=True)
                ]
            )
        if len(self._samples) >= 2 * self._most:
            self._every *= 2
            keep = [k for k, number in enumerate(self._samples) if number % self._every == 0]
            self._samples = [self._samples[k] for k in keep]
            self._rows = [self._rows[k] for k in keep]
            self._pieces = [self._pieces[k] for k in keep]

    def pieces(self, values: Array, lines: int) -> list[list[Piece]]:
        """Those of each of n targets, none of targets that were not looked at.

        values  (MEASURED, samples, n) of all of the recording: what two targets that touch showed as long as they were
                taken for one is left out
        """
        n = values.shape[2]
        found: list[list[Piece]] = [[] for _ in range(n)]
        for number, row in zip(self._samples, self._pieces, strict=True):
            alone = _alone(values[[X, Y, PIXELS], number], self._who[self._who < n], lines)
            for target, piece, free in zip(self._who.tolist(), row, alone.tolist(), strict=False):
                if piece is not None and free:
                    found[target].append(piece)
        return found

    def as_record(self, names: Sequence[str], time_s: Array, lit: Lighting | None = None) -> dict[str, Any]:
        """Of each target the moments, places and widths: time_s (s), Xf, Yf, width (px), lists of equal length.

        lit  how they are lit, where that is from one side: then widths are those of outlines
        """
        out = {}
        for i, target in enumerate([k for k in self._who.tolist() if k < len(names)]):
            if lit is None:
                known = [k for k, row in enumerate(self._rows) if np.isfinite(row[i]).all()]
                seen = np.array([self._rows[k][i] for k in known]).reshape(-1, 3)
                samples = [self._samples[k] for k in known]
            else:
                seen, samples = lit.widths(target)
            out[names[target]] = {
                "time_s": [float(time_s[k]) for k in samples],
                "Xf": np.round(seen[:, 0], 3).tolist(),
                "Yf": np.round(seen[:, 1], 3).tolist(),
                "width": np.round(seen[:, 2], 4).tolist(),
            }
        return out


def _alone(every: Array, who: Ints, lines: int) -> Bools:
    """Which of the tracks `who` have no other one beside them, of Xf, Yf and pixels (3, n) of all: two balls that touch
    look like one that is lit from the side.
    """
    place, radius = every[:2], np.sqrt(every[2] * lines / np.pi)
    off = np.hypot(*(place[:, who, None] - place[:, None]))
    beside = off < radius[who, None] + radius + LOOKS.apart
    beside[np.arange(who.size), who] = False
    return np.asarray(~beside.any(axis=1))

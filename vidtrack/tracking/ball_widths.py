"""How wide the targets of a recording look, at some of its samples: evenly spread, however long it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.measurement.apparent_width import apparent_widths
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import PIXELS, X, Y


@dataclass(frozen=True)
class Looks:
    """How often targets are looked at, so that it takes a few hundredths of a second a recording.

    targets   at most, evenly chosen
    samples   at most; with several targets fewer: so many looks at all of them together
    """

    targets: int = 16
    samples: int = 16
    in_all: int = 192


LOOKS = Looks()


class BallWidths:
    """Collects the widths of n targets; of twice too many samples every other one is forgotten."""

    def __init__(self, n: int, detection: Detection) -> None:
        self._who = np.unique(np.linspace(0, n - 1, min(n, LOOKS.targets)).round().astype(np.intp))
        self._detection = detection
        self._most = min(LOOKS.in_all // max(self._who.size, 1), LOOKS.samples)
        self._every = 1
        self._samples: list[int] = []
        self._rows: list[Array] = []  # Xf, Yf, width of each of those targets

    def passed(self, samples: Sequence[Sample], first: int, values: Array) -> None:
        """Look at samples, the first of which has this number; values (MEASURED, samples or more, n or more)."""
        for j, sample in enumerate(samples):
            if (first + j) % self._every or sample.corrupt or sample.repeated or not self._who.size:
                continue
            x, y, pixels = values[[X, Y, PIXELS], j][:, self._who]
            at = np.stack([x, sample.row(y)], -1)
            grey = self._detection.bright(sample.luma)
            widths = apparent_widths(grey, at, pixels, lines=sample.lines, scale=self._detection.scale)
            self._samples.append(first + j)
            self._rows.append(np.stack([x, y, widths], -1))
        if len(self._samples) >= 2 * self._most:
            self._every *= 2
            keep = [k for k, number in enumerate(self._samples) if number % self._every == 0]
            self._samples = [self._samples[k] for k in keep]
            self._rows = [self._rows[k] for k in keep]

    def as_record(self, names: Sequence[str], time_s: Array) -> dict[str, Any]:
        """Of each target the moments, places and widths: time_s (s), Xf, Yf, width (px), lists of equal length."""
        out = {}
        for i, name in enumerate([names[k] for k in self._who.tolist() if k < len(names)]):
            known = [k for k, row in enumerate(self._rows) if np.isfinite(row[i]).all()]
            seen = np.array([self._rows[k][i] for k in known]).reshape(-1, 3)
            out[name] = {
                "time_s": [float(time_s[self._samples[k]]) for k in known],
                "Xf": np.round(seen[:, 0], 3).tolist(),
                "Yf": np.round(seen[:, 1], 3).tolist(),
                "width": np.round(seen[:, 2], 4).tolist(),
            }
        return out

"""What is wrong by so little that no picture shows it: a stretched tape, a touched zoom ring, clocks set by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, refilmed, run_videos, table_of


def _axis(axis: str, factor: float) -> Callable[[Path, Rng], None]:
    """points.csv with one axis measured by a stretched tape."""

    def change(rows: list[dict[str, str]]) -> None:
        for row in rows:
            row[axis] = str(factor * float(row[axis]))

    return lambda folder, rng: table_of(folder / "calibration/points.csv", change)


def _zoomed(factor: float, every: bool = False) -> Callable[[Path, Rng], None]:
    """One lens, or every lens, at another zoom in the run than in the calibration; the background is plain."""

    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        height, width = pictures[0].shape
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, factor)
        edge = int(np.median(pictures[0]))
        return [cv2.warpAffine(p, turn, (width, height), flags=cv2.INTER_LINEAR, borderValue=edge) for p in pictures]

    def after(folder: Path, rng: Rng) -> None:
        for path in run_videos(folder)[: None if every else 1]:
            refilmed(path, change)

    return after


def _late(offset_s: float) -> Callable[[Scene, Rng], None]:
    """The codes agree, but the clock of a camera that wrote them was set by hand."""

    def before(scene: Scene, rng: Rng) -> None:
        scene["cameras"]["cam2"]["clock"] = {"offset_s": offset_s}

    return before


def _late_and_slow(scene: Scene, rng: Rng) -> None:
    _late(0.04)(scene, rng)
    for target in scene["runs"]["test"]["targets"].values():
        for swing in target["motion"]["oscillations"]:
            swing["amplitude"] *= 0.2


TIME = r"clock|time code|timecode|synchron|later|earlier"
ZOOM = r"zoom|focus"
SLIGHT: dict[str, Circumstance] = {
    "survey-x-stretched": Circumstance(r"scaled|Sx|stretched", after=_axis("x", 1.02), harmless=True),
    "survey-y-stretched": Circumstance(r"scaled|Sx|stretched", after=_axis("y", 1.02), harmless=True),
    "survey-z-stretched": Circumstance(r"scaled|Sx|stretched", after=_axis("z", 1.02), harmless=True),
    "zoomed-slightly": Circumstance(ZOOM, after=_zoomed(1.01), harmless=True),
    "all-zoomed-slightly": Circumstance(ZOOM, after=_zoomed(1.01, every=True), harmless=True),
    "camera-late-slightly": Circumstance(TIME, _late(0.04), harmless=True),
    "camera-late-and-slow": Circumstance(TIME, _late_and_slow, harmless=True),
}

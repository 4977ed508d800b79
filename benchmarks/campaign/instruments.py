"""What instruments do between calibration and run, and along it: clocks that drift or jump, lenses, other balls."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, refilmed, run_videos


def _rate(camera: str, rate_ppm: float) -> Callable[[Scene, Rng], None]:
    def before(scene: Scene, rng: Rng) -> None:
        scene["cameras"][camera]["clock"] = {"rate_ppm": rate_ppm}

    return before


def _jumps(pictures: int) -> Callable[[Path, Rng], None]:
    """Pictures were lost in the middle, and the time code goes on as if they had not been."""

    def after(folder: Path, rng: Rng) -> None:
        at = int(rng.integers(20, 40))
        refilmed(run_videos(folder)[0], lambda p: p[:at] + p[at + pictures :])

    return after


def _refocused(factor: float, blur_px: float) -> Callable[[Path, Rng], None]:
    """All lenses were focused again: the picture is a little larger, and softer."""

    def change(picture: np.ndarray) -> np.ndarray:
        height, width = picture.shape
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, factor)
        edge = int(np.median(picture))
        moved = cv2.warpAffine(picture, turn, (width, height), flags=cv2.INTER_CUBIC, borderValue=edge)
        return cv2.GaussianBlur(moved, (0, 0), blur_px)

    def after(folder: Path, rng: Rng) -> None:
        for path in run_videos(folder):
            refilmed(path, lambda pictures: [change(p) for p in pictures])

    return after


def _drifts(pictures: list[np.ndarray]) -> list[np.ndarray]:
    """A lens that warms up: its picture grows by 1.2 % along the run."""
    height, width = pictures[0].shape
    out = []
    for k, picture in enumerate(pictures):
        factor = 1 + 0.012 * k / len(pictures)
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, factor)
        edge = int(np.median(picture))
        out.append(cv2.warpAffine(picture, turn, (width, height), flags=cv2.INTER_LINEAR, borderValue=edge))
    return out


def _other_balls(diameter: float) -> Callable[[Scene, Rng], None]:
    def before(scene: Scene, rng: Rng) -> None:
        for target in scene["runs"]["test"]["targets"].values():
            target["diameter"] = diameter

    return before


TIME = r"clock|time code|timecode|synchron|later|earlier|rate"
SIGHTS = r"lines of sight|line of sight|disagree"
ZOOM = r"zoom|focus"
INSTRUMENTS: dict[str, Circumstance] = {
    "clock-runs-slow": Circumstance(TIME, _rate("cam2", -3000.0), harmless=True),
    "first-clock-runs-fast": Circumstance(TIME, _rate("cam1", 3000.0), harmless=True),
    "clock-jumps-a-picture": Circumstance(TIME + "|" + SIGHTS + "|pictures", after=_jumps(1), harmless=True),
    "clock-jumps-three-pictures": Circumstance(TIME + "|" + SIGHTS + "|pictures", after=_jumps(3), harmless=True),
    "all-refocused": Circumstance(ZOOM, after=_refocused(1.012, 0.8), harmless=True),
    "lens-warms": Circumstance(
        ZOOM + "|" + SIGHTS, after=lambda folder, rng: refilmed(run_videos(folder)[0], _drifts), harmless=True
    ),
    "targets-larger": Circumstance("", _other_balls(2.1), harmless=True),
}

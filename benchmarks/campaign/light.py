"""What light and lenses do: defocus, long exposures, changes of light, glitter, reflections, zoom."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, refilmed, run_videos


def _picture(**values: Any) -> Callable[[Scene, Rng], None]:
    return lambda scene, rng: scene["picture"].update(values)


def _long_exposure(scene: Scene, rng: Rng) -> None:
    scene["recording"]["shutter"] = {"open_s": 1 / 60, "samples": 9}


def _darker(folder: Path, rng: Rng) -> None:
    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        half = len(pictures) // 2
        return [p if k < half else (p * 0.55).astype(np.uint8) for k, p in enumerate(pictures)]

    refilmed(run_videos(folder)[0], change)


def _glitter(folder: Path, rng: Rng) -> None:
    """Short flashes of the size of targets, some in every picture of every camera."""

    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        answer = []
        for picture in pictures:
            lit = picture.copy()
            for _ in range(int(rng.poisson(6))):
                x, y, r = rng.uniform(10, 370), rng.uniform(170, 280), rng.uniform(1, 4)
                cv2.circle(lit, (round(x), round(y)), round(r), int(rng.uniform(90, 220)), -1, cv2.LINE_AA)
            answer.append(lit)
        return answer

    for path in run_videos(folder):
        refilmed(path, change)


def _reflections(scene: Scene, rng: Rng) -> None:
    """Every target is seen once more below a water surface at z = -9."""
    run = scene["runs"]["test"]
    run["boxes"] = True
    run["others"] = {
        f"mirror_{name}": {**target, "motion": _mirrored(target["motion"], -9.0)}
        for name, target in run["targets"].items()
    }


def _mirrored(motion: dict[str, Any], level: float) -> dict[str, Any]:
    x, y, z = motion["at"]
    swings = [{**s, "along": [s["along"][0], s["along"][1], -s["along"][2]]} for s in motion["oscillations"]]
    return {**motion, "at": [x, y, 2 * level - z], "oscillations": swings}


def _zoomed(folder: Path, rng: Rng) -> None:
    """The lens of a camera was zoomed by 4 % after the calibration."""

    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        height, width = pictures[0].shape
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), 0.0, 1.04)
        edge = int(np.median(pictures[0]))
        return [cv2.warpAffine(p, turn, (width, height), flags=cv2.INTER_AREA, borderValue=edge) for p in pictures]

    refilmed(run_videos(folder)[0], change)


def _rope(folder: Path, rng: Rng) -> None:
    """A dark rope before the scene of one camera."""

    def change(pictures: list[np.ndarray]) -> list[np.ndarray]:
        answer = [p.copy() for p in pictures]
        x = round(float(rng.uniform(150, 230)))
        for picture in answer:
            picture[:, x : x + 4] = 12
        return answer

    refilmed(run_videos(folder)[0], change)


SEEN = r"contrast|noise|threshold|measured|located|blur"
LIGHT: dict[str, Circumstance] = {
    "defocused": Circumstance(SEEN, _picture(blur_px=2.5), harmless=True),
    "exposure-long": Circumstance(SEEN, _long_exposure, harmless=True),
    "light-flickers": Circumstance(SEEN, _picture(flicker=0.3, flicker_hz=7.0), harmless=True),
    "light-fails": Circumstance(SEEN, after=_darker, harmless=True),
    "glitter": Circumstance(SEEN + "|more", after=_glitter, harmless=True),
    "reflections": Circumstance(r"mirror|reflect|more", _reflections, harmless=True),
    "zoomed-after": Circumstance(r"zoom|moved|turned|lines of sight|camera", after=_zoomed),
    "rope-before-targets": Circumstance(SEEN + "|touch", after=_rope, harmless=True),
}

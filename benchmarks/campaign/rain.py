"""Rain: drops on the lenses or the windows of one, two or all cameras; before a plain wall nothing shows them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, refilmed, run_videos

Pictures = list[np.ndarray]


def _longer(scene: Scene, rng: Rng) -> None:
    scene["runs"]["test"]["duration_s"] = 3.0


def _bent(picture: np.ndarray, at: tuple[float, float], drop: dict[str, float]) -> np.ndarray:
    """A picture with one drop: an out-of-focus lens of its own, through which a share of the light comes."""
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]].astype(np.float32)
    off_x, off_y = x - at[0], y - at[1]
    if drop["soft"] == 0:  # bends most in its middle, and less and less outwards
        share = drop["bends"] * np.exp(-(off_x**2 + off_y**2) / drop["radius"] ** 2)
        return cv2.remap(picture, *_floats(x + off_x * share, y + off_y * share), cv2.INTER_CUBIC)
    edge = (np.hypot(off_x, off_y) - drop["radius"]) / drop["soft"]
    share = drop["share"] / (1 + np.exp(np.clip(1.7 * edge, -50, 50)))
    there = at[0] + off_x * (1 + drop["bends"]) + drop["x"], at[1] + off_y * (1 + drop["bends"]) + drop["y"]
    seen = cv2.remap(picture, *_floats(*there), cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return picture + share * (drop["gain"] * cv2.GaussianBlur(seen, (0, 0), drop["blur"]) - picture)


def _floats(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return x.astype(np.float32), y.astype(np.float32)


def _drop(kind: str, rng: Rng) -> dict[str, float]:
    return {
        "x0": rng.uniform(40, 340),
        "y0": rng.uniform(40, 250),
        "radius": rng.uniform(7, 24),
        "bends": rng.uniform(-1.2, 0.7) if kind == "window" else rng.uniform(-0.6, 0.6),
        "share": 1.0 if kind == "window" else rng.uniform(0.15, 0.8),
        "soft": 0.0 if kind == "still" else rng.uniform(1, 4),
        "blur": rng.uniform(0.5, 4),
        "gain": rng.uniform(0.8, 1.15),
        "x": rng.normal(0, 4),
        "y": rng.normal(0, 4),
        "speed": rng.uniform(0.5, 6) if kind == "running" else 0.0,
        "since": float(rng.integers(10, 70)) if kind == "running" else 0.0,
    }


def _wet(pictures: Pictures, drops: list[dict[str, float]]) -> Pictures:
    out = []
    for k, picture in enumerate(pictures):
        wet = picture.astype(np.float32)
        for drop in drops:
            if k >= drop["since"]:
                wet = _bent(wet, (drop["x0"], drop["y0"] + drop["speed"] * (k - drop["since"])), drop).astype(
                    np.float32
                )
        out.append(np.clip(np.rint(wet), 0, 255).astype(np.uint8))
    return out


def _rain(kind: str) -> Callable[[Path, Rng], None]:
    """Two to seven drops on each lens that has any; one camera in half of the cases."""

    def done(folder: Path, rng: Rng) -> None:
        paths = run_videos(folder)
        n = int(rng.choice([1, 1, min(2, len(paths)), len(paths)]))
        for i in sorted(rng.permutation(len(paths))[:n].tolist()):
            drops = [_drop(kind, rng) for _ in range(rng.integers(2, 8))]
            refilmed(paths[i], lambda pictures, drops=drops: _wet(pictures, drops))

    return done


LENS = r"lens or|window|lines of sight|line of sight|measured|disagree"
RAIN: dict[str, Circumstance] = {
    f"rain-{kind}": Circumstance(LENS, _longer, _rain(kind), harmless=True)
    for kind in ("still", "window", "veil", "running")
}

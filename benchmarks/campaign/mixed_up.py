"""What a person mixes up: cameras, clips, pictures, axes, tags, signs, hours, settings."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, Scene, config_of, refilmed, run_videos, table_of

Rows = list[dict[str, str]]


def _exchange(one: Path, other: Path) -> None:
    aside = one.with_name("aside")
    one.rename(aside)
    other.rename(one)
    aside.rename(other)


def _cameras_exchanged(folder: Path, rng: Rng) -> None:
    _exchange(*run_videos(folder)[:2])


def _clips_exchanged(folder: Path, rng: Rng) -> None:
    for clip in sorted(p for p in (folder / "calibration").iterdir() if p.is_dir()):
        _exchange(*sorted(clip.glob("cam*.m*"))[:2])


def _one_clip_twice(folder: Path, rng: Rng) -> None:
    front, rear = folder / "calibration/front", folder / "calibration/rear"
    for path in sorted(rear.glob("cam1.m*")):
        path.unlink()
        os.link(front / path.name, path)


def _turned(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Path, Rng], None]:
    def after(folder: Path, rng: Rng) -> None:
        refilmed(run_videos(folder)[0], lambda pictures: [np.ascontiguousarray(change(p)) for p in pictures])

    return after


def _survey(change: Callable[[Rows], None]) -> Callable[[Path, Rng], None]:
    return lambda folder, rng: table_of(folder / "calibration/points.csv", change)


def _axes_exchanged(rows: Rows) -> None:
    for row in rows:
        row["x"], row["y"] = row["y"], row["x"]


def _in_millimetres(rows: Rows) -> None:
    for row in rows:
        row |= {axis: str(25.4 * float(row[axis])) for axis in ("x", "y", "z", "sigma") if row.get(axis)}


def _sign_lost(rows: Rows) -> None:
    row = next(r for r in rows[13:] if abs(float(r["x"])) > 3)
    row["x"] = str(-float(row["x"]))


def _digits_exchanged(rows: Rows) -> None:
    rows[20]["z"] = str(float(rows[20]["z"]) + 1.8)


def _tags_exchanged(rows: Rows) -> None:
    for axis in "xyz":
        rows[4][axis], rows[30][axis] = rows[30][axis], rows[4][axis]


def _one_axis_scaled(rows: Rows) -> None:
    for row in rows:
        row["z"] = str(1.05 * float(row["z"]))


def _picks_from_below(folder: Path, rng: Rng) -> None:
    def change(rows: Rows) -> None:
        for row in rows:
            row["Yf"] = str(287.0 - float(row["Yf"]))

    for path in sorted((folder / "calibration").glob("*/picks.csv")):
        table_of(path, change)


def _setting(**calibration: Any) -> Callable[[Path, Rng], None]:
    def after(folder: Path, rng: Rng) -> None:
        config_of(folder, lambda c: c.setdefault("calibration", {}).update(calibration))

    return after


def _threshold(value: int) -> Callable[[Path, Rng], None]:
    return lambda folder, rng: config_of(folder, lambda c: c.update(detect={"threshold": value}))


def _polarity(folder: Path, rng: Rng) -> None:
    config_of(folder, lambda c: c.update(detect={"polarity": "dark"}))


def _hour(folder: Path, rng: Rng) -> None:
    refilmed(run_videos(folder)[-1], lambda p: p, "11:00:00:00")


def _frames_of_another_rate(folder: Path, rng: Rng) -> None:
    """A camera whose recording was converted: every sixth picture left out, the rest said to be at the old rate."""
    refilmed(run_videos(folder)[0], lambda pictures: [p for k, p in enumerate(pictures) if k % 6])


def _through_water(scene: Scene, rng: Rng) -> None:
    """All points and targets are under water: the cameras look in from above, or through windows.

    Square on through a window water looks like a lens and a longer focal length, and nothing is wrong.
    """
    tilt = rng.normal(0, 0.01, 2).tolist()
    pane = {"indices": [1.0, 1.49, 1.333], "thickness": float(rng.uniform(0.4, 1.5))}
    if rng.random() < 0.5:
        scene["interfaces"] = {"surface": {"point": [0, 0, 17], "normal": [*tilt, 1], "indices": [1.0, 1.333]}}
    else:
        scene["interfaces"] = {
            "front": {"point": [0, -22, 0], "normal": [tilt[0], 1, tilt[1]], **pane},
            "rear": {"point": [0, 22, 0], "normal": [tilt[1], 1, tilt[0]], **pane},
        }
    for camera in scene["cameras"].values():
        side = "front" if camera["pan_deg"] > 0 else "rear"
        camera["through"] = ["surface" if "surface" in scene["interfaces"] else side]


def _interfaces_not_named(folder: Path, rng: Rng) -> None:
    def change(config: dict[str, Any]) -> None:
        del config["interfaces"]
        for camera in config["cameras"].values():
            del camera["through"]

    config_of(folder, change)


GEOMETRY = r"moved|turned|camera|line of sight|lines of sight"
SURVEY = r"survey|points\.csv|misplaced|tag"
MIXED_UP: dict[str, Circumstance] = {
    "cameras-exchanged": Circumstance("exchanged", after=_cameras_exchanged),
    "clips-exchanged": Circumstance(GEOMETRY, after=_clips_exchanged),
    "clip-twice": Circumstance(r"clip|rear|balls|points|tag", after=_one_clip_twice),
    "run-mirrored": Circumstance("mirrored", after=_turned(lambda p: p[:, ::-1])),
    "run-upside-down": Circumstance("turned by 180", after=_turned(lambda p: p[::-1, ::-1])),
    "survey-axes-exchanged": Circumstance(r"mirror|hand|axes", after=_survey(_axes_exchanged)),
    "survey-in-millimetres": Circumstance("in mm", after=_survey(_in_millimetres)),
    "survey-sign-lost": Circumstance(SURVEY, after=_survey(_sign_lost)),
    "survey-typing-mistake": Circumstance(r"\b21\b", after=_survey(_digits_exchanged)),
    "survey-tags-exchanged": Circumstance(r"\b5\b", after=_survey(_tags_exchanged)),
    "survey-axis-scaled": Circumstance(r"scaled|Sx", after=_survey(_one_axis_scaled)),
    "picks-from-below": Circumstance(r"pick|mirror", after=_picks_from_below),
    "interface": Circumstance(r"through water|interface", _through_water, _interfaces_not_named, harmless=True),
    "interface-named": Circumstance("", _through_water, harmless=True),
    "centre-fixed-wrongly": Circumstance(
        r"fix|Cx|centre|residual|model", after=_setting(fix={"Cx": 120.0, "Cy": 200.0}), harmless=True
    ),
    "threshold-too-high": Circumstance(r"threshold", after=_threshold(250)),
    "threshold-too-low": Circumstance(r"threshold", after=_threshold(4)),
    "polarity-wrong": Circumstance(r"polarity|dark|bright", after=_polarity),
    "hour-off": Circumstance(r"hour|clock|time|moment", after=_hour),
    "rate-converted": Circumstance(r"clock|rate|time|lines of sight|later", after=_frames_of_another_rate),
}

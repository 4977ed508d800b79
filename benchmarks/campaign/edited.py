"""What people do to films on the way from the camera: turned, cut, put under another name; numbers exchanged."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign.changes import Circumstance, Rng, config_of, refilmed, run_videos

CUT = (22, 37)
"""Pictures that are cut out of every film of the run."""


def _all_upside_down(folder: Path, rng: Rng) -> None:
    """All cameras hung upside down for the run, or one program turned all films."""
    for path in run_videos(folder):
        refilmed(path, lambda pictures: [np.ascontiguousarray(p[::-1, ::-1]) for p in pictures])


def _all_cut(folder: Path, rng: Rng) -> None:
    """The same part cut out of all films, whose time goes on as if it were there."""
    for path in run_videos(folder):
        refilmed(path, lambda pictures: pictures[: CUT[0]] + pictures[CUT[1] :])


def _copied_clip(folder: Path, rng: Rng) -> None:
    """One camera's calibration clip under another camera's name, coded again."""
    (copy,), (film,) = ((folder / "calibration/middle").glob(f"{camera}.m*") for camera in ("cam2", "cam1"))
    copy.write_bytes(film.read_bytes())
    refilmed(copy, lambda pictures: pictures)


def _sensor_exchanged(folder: Path, rng: Rng) -> None:
    """Height and width of every camera's sensor."""

    def change(config: dict[str, Any]) -> None:
        for camera in config["cameras"].values():
            camera["sensor"] = camera["sensor"][::-1]

    config_of(folder, change)


EDITED: dict[str, Circumstance] = {
    "all-upside-down": Circumstance(r"turned by 180", after=_all_upside_down),
    "all-cut": Circumstance(r"cut out", after=_all_cut),
    "clip-copied": Circumstance(r"copy of that film", after=_copied_clip),
    "sensor-exchanged": Circumstance(r"seem to be exchanged", after=_sensor_exchanged, harmless=True),
}

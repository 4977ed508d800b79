"""What changes a scenario before it is filmed, or an experiment folder afterwards, as a person or a fault would."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vidtrack.simulate.tape import Tape, write_tape
from vidtrack.timing.timecode import parse
from vidtrack.video.reader import open_video

Scene = dict[str, Any]
Rng = np.random.Generator


def nothing_before(scene: Scene, rng: Rng) -> None:
    return


def nothing_after(folder: Path, rng: Rng) -> None:
    return


@dataclass(frozen=True)
class Circumstance:
    named: str
    before: Callable[[Scene, Rng], None] = nothing_before
    after: Callable[[Path, Rng], None] = nothing_after
    harmless: bool = False


def config_of(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change config.yaml as a user would."""
    path = folder / "config.yaml"
    config = yaml.safe_load(path.read_text())
    change(config)
    path.write_text(yaml.safe_dump(config, sort_keys=False))


def table_of(path: Path, change: Callable[[list[dict[str, str]]], None]) -> None:
    """Change a CSV file as a user would."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    header = list(rows[0])
    change(rows)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, header)
        writer.writeheader()
        writer.writerows(rows)


def refilmed(
    path: Path, change: Callable[[list[np.ndarray]], list[np.ndarray]], code: str = "10:00:00:00", **tape: Any
) -> None:
    """Write a recording again with changed pictures, without loss."""
    with open_video(str(path)) as video:
        pictures = [np.array(frame.luma) for frame in video.frames()]
    drop = ";" in code
    rate = video.info.rate
    path.unlink()
    write_tape(
        str(path.with_suffix(".mkv")),
        iter(change(pictures)),
        Tape(codec="ffv1", container="mkv", **tape),
        rate=rate,
        bits=8,
        interlace="none",
        start=parse(code, rate, drop),
        lost=frozenset(),
        sound=None,
    )


def run_videos(folder: Path) -> list[Path]:
    return sorted((folder / "runs/test").glob("cam*.m*"))


def film_without_loss(scene: Scene, rng: Rng) -> None:
    scene["recording"]["tape"] = {"codec": "ffv1", "container": "mkv"}

"""Timestacks in and out: one .npz a run, `<transect>/<field>` for every array."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.files.atomic import replacing


def write_timestacks(path: str | os.PathLike[str], stacks: Mapping[str, Mapping[str, NDArray[Any]]]) -> None:
    """Write transect: {grey, time_s, s, p, b}; see `vidtrack.stages.waterline.Timestack`."""
    arrays = {f"{name}/{field}": array for name, stack in stacks.items() for field, array in stack.items()}
    with replacing(path) as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def read_timestacks(path: str | os.PathLike[str]) -> dict[str, dict[str, NDArray[Any]]]:
    """What `write_timestacks` wrote."""
    stacks: dict[str, dict[str, NDArray[Any]]] = {}
    with np.load(path) as file:
        for key in file.files:
            name, field = key.rsplit("/", 1)
            stacks.setdefault(name, {})[field] = file[key]
    return stacks

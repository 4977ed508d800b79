"""Timestacks in and out: one .npz a run, `<transect>/<field>` for every array."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vidtrack.errors import damaged
from vidtrack.files.atomic import replacing

_DAMAGE = (zipfile.BadZipFile, zlib.error, ValueError, KeyError, EOFError, OSError, NotImplementedError, RuntimeError)


def write_timestacks(path: str | os.PathLike[str], stacks: Mapping[str, Mapping[str, NDArray[Any]]]) -> None:
    """Write transect: {grey, time_s, s, p, b}; see `vidtrack.stages.waterline.Timestack`."""
    arrays = {f"{name}/{field}": array for name, stack in stacks.items() for field, array in stack.items()}
    with replacing(path) as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def read_timestacks(path: str | os.PathLike[str]) -> dict[str, dict[str, NDArray[Any]]]:
    """What `write_timestacks` wrote; VidtrackError where the file is damaged."""
    stacks: dict[str, dict[str, NDArray[Any]]] = {}
    try:
        with np.load(path) as file:
            for key in file.files:
                name, field = key.rsplit("/", 1)
                stacks.setdefault(name, {})[field] = file[key]
    except FileNotFoundError:
        raise
    except (*_DAMAGE, AttributeError, TypeError) as error:
        raise damaged(path, "not a file of timestacks, or damaged", error) from None
    return stacks

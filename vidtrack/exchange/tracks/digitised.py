"""Tracks as another program has them, and how they become frame-buffer coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path

Origin = Literal["upper-left", "lower-left"]

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Digitised:
    """The tracks of one camera.

    format      name of the format
    names       n targets; named: whether a name means one thing in all cameras (else they are numbers of this file)
    frame       (k,) numbers of pictures, rising, from 0
    b           (k, n, 2) in the file's pixels, NaN where a target was not found
    origin      where the file's pixels are counted from; None: the format does not say
    first       coordinates (x, y) of the centre of the pixel next to the origin; None: the format does not say
    size        (width, height) px of the picture, where the file says it
    time_s      (k,) s, where the file has times; code (k,) labels of time code, 30 a second of NTSC
    rate        pictures a second, where the file says it
    together    whether a row is one moment of all cameras: their frames need no clock
    notes       what the reader left out or changed, a sentence each
    """

    format: str
    names: tuple[str, ...]
    frame: Ints
    b: Array
    named: bool
    origin: Origin | None = None
    first: tuple[float, float] | None = None
    size: tuple[int, int] | None = None
    time_s: Array | None = None
    code: tuple[str, ...] | None = None
    rate: float | None = None
    together: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Convention:
    """What the user says of a file: None where nothing was said. camera: which of the file's cameras is meant."""

    format: str | None = None
    camera: str | None = None
    origin: Origin | None = None
    first: tuple[float, float] | None = None
    size: tuple[int, int] | None = None
    likelihood: float | None = None

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Convention:
        """From the values of a `tracks` section of the config."""
        first, size = said.get("first_pixel"), said.get("size")
        return cls(
            format=said.get("format"),
            camera=said.get("camera"),
            origin=said.get("origin"),
            first=None if first is None else (float(first[0]), float(first[1])),
            size=None if size is None else (int(size[0]), int(size[1])),
            likelihood=said.get("likelihood"),
        )


def placed(tracks: Digitised, said: Convention, where: str) -> Array:
    """Frame-buffer coordinates (k, n, 2): the centre of the top-left pixel is (0, 0), X right, Y down.

    where   the place in config.yaml, for messages
    Raises VidtrackError, naming the key, for what neither the format nor the config says.
    """
    origin, first, size = said.origin or tracks.origin, said.first or tracks.first, said.size or tracks.size
    if origin is None:
        raise VidtrackError(
            f"config.yaml: {where}.origin: a {tracks.format} file does not say whether pixels are counted from the "
            "upper-left or the lower-left corner. Give origin: upper-left or origin: lower-left."
        )
    if first is None:
        raise VidtrackError(
            f"config.yaml: {where}.first_pixel: a {tracks.format} file does not say which coordinate the centre "
            "of its first "
            "pixel has. Give first_pixel: 0, 0.5 or 1."
        )
    b = np.array(tracks.b)
    b[..., 0] -= first[0]
    b[..., 1] -= first[1]
    if origin == "lower-left":
        if size is None:
            raise VidtrackError(
                f"config.yaml: {where}.size: rows are counted from below, and the height of the picture is not known. "
                "Give size: [width, height] in px."
            )
        b[..., 1] = size[1] - 1 - b[..., 1]
    if size is not None:
        _check_inside(b, size, where)
    return b


def _check_inside(b: Array, size: tuple[int, int], where: str) -> None:
    """Refuse tracks of which many lie outside the picture: its size or their convention is another."""
    seen = np.isfinite(b).all(-1)
    outside = seen & ((b < -1).any(-1) | (b[..., 0] > size[0]) | (b[..., 1] > size[1]))
    if outside.sum() > 0.02 * max(int(seen.sum()), 1):
        raise VidtrackError(
            f"config.yaml: {where}: {outside.sum()} of {seen.sum()} samples lie outside the picture of {size[0]} "
            f"x {size[1]} "
            "px. Correct size, origin or first_pixel."
        )


def of_rows(
    path: Path, frame: Sequence[float] | Array, name: Sequence[object] | NDArray[np.object_], b: Array
) -> tuple[tuple[str, ...], Ints, Array, int]:
    """Names, frames (k,) and positions (k, n, 2) from rows of one sample each, and how many rows were there twice.

    VidtrackError for a frame that is no whole number: it may be a time.
    """
    given = np.asarray(frame, float)
    if (odd := given[given != np.floor(given)]).size:
        raise VidtrackError(f"{path}: frame {odd[0]:g} is no whole number. Write which picture each row is of.")
    frames, at = np.unique(given.astype(np.int64), return_inverse=True)
    labels = np.asarray([str(each) for each in name], object)
    names, first, which = np.unique(labels.astype(str), return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # as they appear in the file
    place = np.empty(len(order), np.intp)
    place[order] = np.arange(len(order))
    out = np.full((len(frames), len(names), 2), np.nan)
    column = place[which]
    out[at, column] = b
    twice = len(labels) - len(np.unique(at * len(names) + column))
    return tuple(str(names[k]) for k in order), frames, out, twice

"""DeepLabCut, and anipose's 2-D files, which have its layout: CSV or HDF5 of one camera.

Three header rows (scorer, bodyparts, coords), or four with `individuals`, then a row a frame: its number and x, y,
likelihood of each body part. Upper-left origin, the centre of the first pixel is (0, 0), y down, px. Every part has
a place in every frame, however unlikely: what is not seen has a low likelihood, and the file does not say which is
too low: `tracks.likelihood` does, DeepLabCut's own default being 0.6. Hand labels have no likelihood, and NaN.
anipose's files hold alternatives as x0, y0 ...: of these x, y alone are read. HDF5 is a table that pandas wrote
(`df_with_missing`). Source: deeplabcut analyze_videos; pandas to_hdf.
"""

from __future__ import annotations

import io
import pickle
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, number
from vidtrack.exchange.tracks.digitised import Convention, Digitised
from vidtrack.exchange.tracks.table import numbers_of, split


def is_header(header: list[str]) -> bool:
    """Whether the first row is DeepLabCut's."""
    return bool(header) and header[0].strip().lower() == "scorer"


def read(path: Path, text: str, said: Convention, where: str) -> Digitised:
    """The body parts in a CSV."""
    heads, table = split(text, 3)
    if len(heads) == 3 and heads[1][0].lower() == "individuals":
        heads, table = split(text, 4)
    words = [head[0].lower() for head in heads]
    if words[0] != "scorer" or words[-1] != "coords":
        raise VidtrackError(
            f"{path}: its header has rows {', '.join(words)}, not scorer, bodyparts, coords. Export it again."
        )
    width = len(heads[-1])
    ragged = [head for head in heads if len(head) != width]
    if ragged:
        raise VidtrackError(
            f"{path}: its header rows have {len(ragged[0])} and {width} cells. Copy the whole file again."
        )
    columns = [tuple(head[k] for head in heads[1:]) for k in range(1, width)]
    first = [line.split(table.separator)[0] for line in table.text.split("\n") if line.strip()]
    frame = _frames(path, first)
    values = numbers_of(path, table._replace(header=heads[-1]), list(range(1, width)))
    return _of(path, columns, frame, values, said, where)


def read_h5(path: Path, file: Any, said: Convention, where: str) -> Digitised:
    """The body parts in an HDF5 file that pandas wrote; file: an open h5py.File."""
    group = next((each for each in file.values() if hasattr(each, "attrs") and "pandas_type" in each.attrs), None)
    if group is None:
        raise VidtrackError(
            f"{path}: no table of DeepLabCut and no analysis of SLEAP in this HDF5 file. Export one of them."
        )
    try:
        if "table" in group:
            columns = [
                tuple(str(part) for part in each) for each in _plain(group["table"].attrs["values_block_0_kind"])
            ]
            data = group["table"][:]
            frame, values = np.asarray(data["index"]), np.asarray(data["values_block_0"], float)
        else:
            levels = [
                [_text(each) for each in group[f"axis0_level{k}"][:]] for k in range(int(group.attrs["axis0_nlevels"]))
            ]
            codes = [group[f"axis0_label{k}"][:] for k in range(len(levels))]
            columns = [
                tuple(level[c] for level, c in zip(levels, row, strict=True)) for row in zip(*codes, strict=True)
            ]
            frame, values = np.asarray(group["axis1"][:]), np.asarray(group["block0_values"][:], float)
    except (KeyError, ValueError, TypeError, pickle.UnpicklingError, AttributeError, OSError) as error:
        raise VidtrackError(
            f"{path}: a table of pandas in a form that is not known ({str(error)[:80]}). Export it as CSV."
        ) from None
    if frame.dtype.kind not in "iuf":
        frame = _frames(path, [_text(each) for each in frame])
    return _of(path, [column[1:] for column in columns], np.asarray(frame, np.int64), values, said, where)


def _of(
    path: Path, columns: list[tuple[str, ...]], frame: Array | Any, values: Array, said: Convention, where: str
) -> Digitised:
    """columns  of the values: (individual,) body part, coordinate."""
    at: dict[str, dict[str, int]] = {}
    for k, column in enumerate(columns):
        name = "_".join(part for part in column[:-1] if part and part != "single")
        at.setdefault(name, {})[column[-1]] = k
    names = [name for name, parts in at.items() if {"x", "y"} <= set(parts)]
    if not names:
        raise VidtrackError(f"{path}: no column x and y of any body part. Export it again.")
    b = values[:, [[at[name]["x"], at[name]["y"]] for name in names]]
    likely = [at[name].get("likelihood") for name in names]
    notes: tuple[str, ...] = ()
    if any(k is not None for k in likely):
        if said.likelihood is None:
            raise VidtrackError(
                f"config.yaml: {where}.likelihood: every point of {path} has a likelihood, and low ones are no "
                "measurements. "
                "Say from which on they count, as in likelihood: 0.6."
            )
        p = np.stack([values[:, k] if k is not None else np.ones(len(values)) for k in likely], 1)
        low = ~(p >= said.likelihood) & np.isfinite(b).all(-1)
        b[low] = np.nan
        notes = (f"{low.sum()} points less likely than {said.likelihood:g} count as missing",) if low.any() else ()
    order = np.argsort(frame, kind="stable")
    frame, b = np.asarray(frame, np.int64)[order], b[order]
    if len(np.unique(frame)) < len(frame):
        raise VidtrackError(f"{path}: a frame has two rows. Keep one of them.")
    return Digitised("deeplabcut", tuple(names), frame, b, True, "upper-left", (0.0, 0.0), notes=notes)


def _frames(path: Path, cells: list[str]) -> Any:
    """Numbers of frames: as they stand, or those in names such as img0012.png."""
    import re

    found = []
    for cell in cells:
        value = number(cell)
        if value is None:
            digits = re.findall(r"\d+", cell)
            value = float(digits[-1]) if digits else None
        if value is None or value != value:
            raise VidtrackError(f"{path}: {cell[:40]!r} in its first column is no frame. Correct the file.")
        found.append(int(value))
    return np.array(found, np.int64)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


class _Names(pickle.Unpickler):
    """Unpickles names and numbers, and refuses whatever would run code."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"{module}.{name} is not a name")


def _plain(value: Any) -> Any:
    """What pandas pickled among the attributes: lists of tuples of names."""
    data = value if isinstance(value, bytes) else bytes(value)
    return _Names(io.BytesIO(data), encoding="utf-8").load()

"""Records of other instruments: wave gauges, load cells, lamps; as CSV, Parquet, MAT (level 5) or TDMS.

Columns of CSV and Parquet go by their names. Variables of a MAT file go by theirs, fields of structures after a point
(`daq.gauge1`), columns of a matrix after a colon, from 1 (`data:3`). Channels of a TDMS file are `group/channel`, or
the channel alone where only one group has it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.files.child_process import in_child
from vidtrack.files.csv_columns import Columns, own_unit
from vidtrack.files.tables import read_csv
from vidtrack.naming import hint_of

if TYPE_CHECKING:
    from pandas import DataFrame


class ChannelFile(NamedTuple):
    """names of what the file holds; values: those of one of them (n,); times: s, where the file has its own clock."""

    names: list[str]
    values: Callable[[str], Any]
    times: Callable[[str], Array | None]


def read_channels(path: str, columns: Mapping[str, str], *, time: str | None, rate: float | None = None) -> DataFrame:
    """time_s and a column for each channel, NaN where missing.

    columns   channel: its name in the file
    time      the name of the times, s; None: those that the file has by itself (TDMS), or its samples at `rate`, Hz,
              from 0 on
    Raises VidtrackError naming the file for what cannot be read, is not there, or has other lengths.
    """
    import pandas as pd

    kind = os.path.splitext(path)[1].lower()
    found = READERS[kind](path) if kind in READERS else _csv(path, columns.values(), time)
    if time and (unit := own_unit(time)) not in ("", "s"):
        raise VidtrackError(f"{path}: {time} is in {unit}, and vidtrack reads times in s. Convert it, and name it so.")
    values = {channel: _numbers(path, found, name) for channel, name in columns.items()}
    if time is not None and (time in found.names or kind != ".tdms"):
        t = _numbers(path, found, time)
    else:
        own = found.times(next(iter(columns.values())))
        length = len(next(iter(values.values())))
        if own is None and rate is None:
            raise VidtrackError(f"{path}: has no times. Name their column (channels.time) or give channels.rate, Hz.")
        t = np.arange(length) / rate if own is None and rate is not None else np.asarray(own, float)
    lengths = {len(t), *(len(v) for v in values.values())}
    if len(lengths) > 1:
        each = ", ".join(f"{name} {len(values[channel])}" for channel, name in columns.items())
        text = f"{path}: channels differ in length ({time or 'times'} {len(t)}, {each})."
        raise VidtrackError(f"{text} Name such of one length.")
    bad = np.flatnonzero(~np.isfinite(t))
    if bad.size:
        raise VidtrackError(f"{path}: {time or 'times'}: row {bad[0] + 1} has no time. Fill it in or delete the row.")
    back = np.flatnonzero(np.diff(t) <= 0)
    if back.size:
        k = int(back[0])
        text = f"{path}: {time or 'times'} do not rise: row {k + 2} has {t[k + 1]:.6g} s after {t[k]:.6g} s."
        raise VidtrackError(f"{text} Sort the rows, each time once.")
    return pd.DataFrame({"time_s": t, **values})


def _numbers(path: str, found: ChannelFile, name: str) -> Array:
    if name not in found.names:
        known = hint_of(name, found.names, f"it has {', '.join(found.names[:12]) or 'none'}.")
        raise VidtrackError(f"{path}: no channel '{name}'; {known}")
    try:
        values = np.asarray(found.values(name), float)
    except (TypeError, ValueError):
        raise VidtrackError(f"{path}: {name} holds no numbers. Name another channel.") from None
    if values.ndim > 1 and sum(size > 1 for size in values.shape) > 1:
        text = f"{path}: {name} has the shape {' x '.join(map(str, values.shape))}."
        raise VidtrackError(f"{text} Name one of its columns, as {name}:1.")
    return values.ravel()


def _unreadable(path: str, kind: str, why: Exception) -> VidtrackError:
    reason = " ".join(str(why).split())[:120] or type(why).__name__
    return VidtrackError(f"{path}: cannot be read as {kind} ({reason}). Save it again, or as CSV.")


def _csv(path: str, names: Iterable[str], time: str | None) -> ChannelFile:
    numbers = list(dict.fromkeys([*names, *([time] if time else [])]))
    units = {time: "s"} if time else {}
    table = read_csv(path, Columns(numbers=numbers, blanks=numbers, units=units), others="ignore")
    return ChannelFile(list(table.columns), lambda name: table[name], lambda _: None)


def _parquet(path: str) -> ChannelFile:
    import pyarrow.parquet as pq

    with _reading(path, "Parquet"), pq.ParquetFile(path) as file:
        table = file.read().to_pandas()
    return ChannelFile([str(name) for name in table.columns], lambda name: table[name], lambda _: None)


def _mat(path: str) -> ChannelFile:
    with _reading(path, "MAT"):
        flat, refused = in_child(_mat_values, path)
    if refused is not None:
        raise VidtrackError(refused)
    return ChannelFile(list(flat), flat.__getitem__, lambda _: None)


def _mat_values(path: str) -> tuple[dict[str, Any], str | None]:
    """The variables of a MAT file, and why there are none; for a child process: damaged files kill scipy's reader."""
    from scipy.io import loadmat

    flat: dict[str, Any] = {}
    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        return flat, f"{path}: is a MAT file of version 7.3. Save it as level 5: save(..., '-v7')."
    for name, value in content.items():
        if not name.startswith("__"):
            _flatten(flat, name, value)
    return flat, None


@contextmanager
def _reading(path: str, kind: str) -> Iterator[None]:
    """Whatever another program's library raises over a damaged file becomes one line."""
    try:
        yield
    except VidtrackError:
        raise
    except Exception as error:
        raise _unreadable(path, kind, error) from None


def _flatten(flat: dict[str, Any], name: str, value: Any) -> None:
    if isinstance(value, dict):
        for key, inner in value.items():
            _flatten(flat, f"{name}.{key}", inner)
        return
    flat[name] = value
    matrix = np.asarray(value) if isinstance(value, np.ndarray) else None
    if matrix is not None and matrix.ndim == 2 and min(matrix.shape) > 1:
        flat |= {f"{name}:{k + 1}": matrix[:, k] for k in range(matrix.shape[1])}


def _tdms(path: str) -> ChannelFile:
    try:
        from nptdms import TdmsFile
    except ImportError:
        text = f"{path}: TDMS files are read by the package npTDMS, which is not installed."
        raise VidtrackError(f"{text} Install it (pip install npTDMS), or save the record as CSV.") from None
    with _reading(path, "TDMS"):
        file = TdmsFile.read(path)
        each = {f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()}
    short = [name.split("/", 1)[1] for name in each]
    each |= {name.split("/", 1)[1]: own for name, own in list(each.items()) if short.count(name.split("/", 1)[1]) == 1}

    def times(name: str) -> Array | None:
        with _reading(path, "TDMS"):
            channel = each[name]
            step = channel.properties.get("wf_increment")
            first = channel.properties.get("wf_start_offset", 0.0)
            return np.asarray(float(first) + float(step) * np.arange(len(channel))) if step else None

    def values(name: str) -> Any:
        with _reading(path, "TDMS"):
            return each[name][:]

    return ChannelFile(list(each), values, times)


READERS: dict[str, Callable[[str], ChannelFile]] = {
    ".parquet": _parquet,
    ".pq": _parquet,
    ".mat": _mat,
    ".tdms": _tdms,
}
"""By the ending of the file's name; all others are read as CSV."""

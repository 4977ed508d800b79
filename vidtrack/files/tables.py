"""Tables in and out: Parquet with units and provenance in its schema, CSV with errors that name the line."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import replacing
from vidtrack.files.records import plain
from vidtrack.naming import did_you_mean

if TYPE_CHECKING:
    from pandas import DataFrame

Path = str | os.PathLike[str]

UNITS = {
    **dict.fromkeys(("x", "y", "z", "sigma", "sigma_x", "sigma_y", "sigma_z", "miss", "rms"), "world"),
    **dict.fromkeys(("x_located", "y_located", "z_located"), "world"),
    **dict.fromkeys(("vx", "vy", "vz"), "world/s"),
    **dict.fromkeys(("ax", "ay", "az"), "world/s^2"),
    **dict.fromkeys(("roll", "pitch", "yaw"), "deg"),
    **dict.fromkeys(("Xf", "Yf", "sd_x", "sd_y", "box_x", "box_y", "box_w", "box_h"), "px"),
    **dict.fromkeys(("residual_x", "residual_y", "Xf_projected", "Yf_projected"), "px"),
    **dict.fromkeys(("Xf_no_distortion", "Yf_no_distortion", "Xf_from_located", "Yf_from_located"), "px"),
    **dict.fromkeys(("pixels", "total_pixels"), "px^2"),
    "time_s": "s",
}
"""The unit of every column that has one, by name; `world` stands for the experiment's unit of length."""


def write_parquet(
    path: Path,
    table: DataFrame,
    *,
    units: str,
    provenance: Mapping[str, Any],
    columns: Mapping[str, str] | None = None,
) -> None:
    """Write a table; each column carries its unit, the schema carries the provenance.

    units     the experiment's unit of length, which `world` stands for
    columns   units of columns that `UNITS` does not know
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    known = {**UNITS, **(columns or {})}
    arrow = pa.Table.from_pandas(table, preserve_index=False)
    fields = [
        field.with_metadata({"unit": known.get(field.name, "").replace("world", units)}) for field in arrow.schema
    ]
    whole = {
        "units": json.dumps({field.name: field.metadata[b"unit"].decode() for field in fields}),
        "provenance": json.dumps(plain(provenance), sort_keys=True),
    }
    schema = pa.schema(fields, metadata={**(arrow.schema.metadata or {}), **{k.encode(): v for k, v in whole.items()}})
    with replacing(path) as file:
        pq.write_table(arrow.cast(schema), file, compression="zstd")


def read_parquet(path: Path) -> DataFrame:
    """The table at `path`; VidtrackError where it is not Parquet."""
    import pandas as pd
    import pyarrow as pa

    try:
        return pd.read_parquet(path)
    except pa.ArrowInvalid as error:
        raise VidtrackError(f"{path}: not a Parquet table ({error}). Delete the file and run again.") from None


def read_units(path: Path) -> dict[str, str]:
    """The unit of every column of the Parquet table at `path`."""
    import pyarrow.parquet as pq

    metadata = pq.read_schema(path).metadata or {}
    return dict(json.loads(metadata.get(b"units", b"{}")))


def write_csv(path: Path, table: DataFrame) -> None:
    """Write a table as CSV; NaN is an empty cell."""
    with replacing(path) as file:
        file.write(table.to_csv(index=False, lineterminator="\n").encode())


def read_csv(
    path: Path,
    *,
    numbers: Sequence[str] = (),
    texts: Sequence[str] = (),
    optional: Sequence[str] = (),
    blanks: Sequence[str] = (),
    unique: Sequence[str] = (),
    others: str = "forbid",
) -> DataFrame:
    """A CSV table that a person wrote, checked cell by cell.

    numbers, texts   the columns that hold numbers and words, in the order of the answer
    optional         those of them that may be absent (then they are absent in the answer)
    blanks           number columns in which an empty cell is allowed, and becomes NaN
    unique           columns whose cells together name a row once
    others           forbid | ignore: what to do with columns that nobody asked for
    Column `line` of the answer is the row's line in the file.
    Raises VidtrackError with every bad cell (ten at most), each with its line.
    """
    import pandas as pd

    rows, header, lines = _rows(path)
    wanted = [*texts, *numbers]
    problems = _header_problems(path, header, wanted, optional, others)
    if problems:
        raise VidtrackError(*problems)
    present = [name for name in wanted if name in header]
    columns: dict[str, list[Any]] = {name: [] for name in present}
    seen: dict[tuple[str, ...], int] = {}
    for row, line in zip(rows, lines, strict=True):
        if len(row) != len(header):
            problems.append(
                f"{path}, line {line}: {len(row)} cells where the header names {len(header)}. Mend the row."
            )
            continue
        cells = dict(zip(header, (cell.strip() for cell in row), strict=True))
        for name in present:
            if name in numbers:
                columns[name].append(_number(path, line, name, cells[name], name in blanks, problems))
            else:
                if not cells[name]:
                    problems.append(f"{path}, line {line}: {name} is empty. Fill it in or delete the row.")
                columns[name].append(cells[name])
        key = tuple(cells[name] for name in unique)
        if unique and key in seen:
            problems.append(
                f"{path}, line {line}: {' '.join(f'{n} {k}' for n, k in zip(unique, key, strict=True))} appears twice "
                f"(also line {seen[key]}). Name each once."
            )
        seen[key] = line
    if problems:
        raise VidtrackError(*problems[:10], *([f"{path}: and {len(problems) - 10} more"] if len(problems) > 10 else []))
    if not rows:
        raise VidtrackError(f"{path}: has a header but no rows. Add a row for each {wanted[0]}.")
    table = pd.DataFrame(
        {name: pd.array(cells, "float64") if name in numbers else cells for name, cells in columns.items()}
    )
    for name in present:
        if name in numbers:
            table[name] = table[name].astype("float64")
    table["line"] = lines
    return table


def _rows(path: Path) -> tuple[list[list[str]], list[str], list[int]]:
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            read = [(row, reader.line_num) for row in reader if any(cell.strip() for cell in row)]
    except FileNotFoundError:
        raise VidtrackError(f"{path}: no such file. Put it there or correct its name.") from None
    except UnicodeDecodeError:
        raise VidtrackError(f"{path}: not a text file in UTF-8. Save it as CSV.") from None
    except csv.Error as error:
        raise VidtrackError(f"{path}: not CSV ({error}). Save it as CSV.") from None
    read = [(row, line) for row, line in read if not row[0].lstrip().startswith("#")]
    if not read:
        raise VidtrackError(f"{path}: empty. Write a header and a row for each entry.")
    header = [cell.strip() for cell in read[0][0]]
    return [row for row, _ in read[1:]], header, [line for _, line in read[1:]]


def _header_problems(
    path: Path, header: list[str], wanted: list[str], optional: Sequence[str], others: str
) -> list[str]:
    problems = [
        f"{path}, line 1: column {name} appears twice. Keep one." for i, name in enumerate(header) if name in header[:i]
    ]
    unknown = [name for name in header if name not in wanted]
    missing = [name for name in wanted if name not in header and name not in optional]
    for name in missing:
        near = did_you_mean(name, unknown)
        problems.append(
            f"{path}, line 1: no column {name}"
            + (f"; is it {near!r}?" if near else f" among {', '.join(header)}.")
            + f" The header must name {', '.join(w for w in wanted if w not in optional)}."
        )
    if others == "forbid" and not missing:
        for name in unknown:
            near = did_you_mean(name, wanted)
            problems.append(
                f"{path}, line 1: no such column as {name!r}"
                + (f"; did you mean {near!r}?" if near else f". Known: {', '.join(wanted)}.")
            )
    return problems


def _number(path: Path, line: int, name: str, cell: str, blank: bool, problems: list[str]) -> float:
    if not cell and blank:
        return math.nan
    try:
        value = float(cell)
        if math.isfinite(value) or (blank and math.isnan(value)):
            return value
    except ValueError:
        pass
    problems.append(f"{path}, line {line}: {name} is {cell!r}, not a number. Write a number.")
    return math.nan


def read_points(path: Path) -> DataFrame:
    """Surveyed points: tag, x, y, z, sigma (NaN where the file has none); world units."""
    table = read_csv(
        path, texts=["tag"], numbers=["x", "y", "z", "sigma"], optional=["sigma"], blanks=["sigma"], unique=["tag"]
    )
    if "sigma" not in table:
        table.insert(4, "sigma", math.nan)
    return table


def read_picks(path: Path, camera: str | None = None) -> DataFrame:
    """Where tagged points roughly are: camera, tag, Xf, Yf (px); those of one camera where it is named."""
    table = read_csv(path, texts=["camera", "tag"], numbers=["Xf", "Yf"], unique=["camera", "tag"])
    return table if camera is None else table[table["camera"] == camera].reset_index(drop=True)


def read_targets(path: Path, camera: str | None = None) -> DataFrame:
    """Where boxes start: camera, target, Xf, Yf (px), width, height (px, NaN: the config's box)."""
    table = read_csv(
        path,
        texts=["camera", "target"],
        numbers=["Xf", "Yf", "width", "height"],
        optional=["width", "height"],
        blanks=["width", "height"],
        unique=["camera", "target"],
    )
    for name in ("width", "height"):
        if name not in table:
            table[name] = math.nan
    return table if camera is None else table[table["camera"] == camera].reset_index(drop=True)

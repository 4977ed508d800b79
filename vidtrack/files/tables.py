"""Tables in and out: Parquet with units and provenance in its schema, CSV with errors that name the line."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from vidtrack.errors import VidtrackError, damaged
from vidtrack.files.atomic import replacing
from vidtrack.files.csv_checked import checked_csv
from vidtrack.files.csv_columns import PICKS, POINTS, TARGETS, TRUTH, Columns
from vidtrack.files.records import plain

if TYPE_CHECKING:
    from pandas import DataFrame

Path = str | os.PathLike[str]

UNITS = {
    **dict.fromkeys(("x", "y", "z", "sigma", "sigma_x", "sigma_y", "sigma_z", "miss", "rms"), "world"),
    **dict.fromkeys(("x_located", "y_located", "z_located"), "world"),
    **dict.fromkeys(("vx", "vy", "vz"), "world/s"),
    **dict.fromkeys(("ax", "ay", "az"), "world/s^2"),
    **dict.fromkeys(("roll", "pitch", "yaw"), "deg"),
    **dict.fromkeys(("Xf", "Yf", "sd_x", "sd_y", "box_x", "box_y", "box_w", "box_h", "width"), "px"),
    **dict.fromkeys(("residual_x", "residual_y", "outline_x", "outline_y", "Xf_projected", "Yf_projected"), "px"),
    **dict.fromkeys(("Xf_no_distortion", "Yf_no_distortion", "Xf_from_located", "Yf_from_located"), "px"),
    **dict.fromkeys(("pixels", "total_pixels"), "px^2"),
    **dict.fromkeys(("time_s", "stamp_s", "middle_s"), "s"),
}
"""The unit of every column that has one, by name; `world` stands for the experiment's unit of length."""

CHECKSUM = b"checksum"
"""The key, among what a schema says, of the checksum of all the rest of it."""

THREADS_FROM = 100_000
"""Rows of a table from which on threads read its columns: below, they cost as much again as what they do."""

LARGE = 16 << 20
"""Bytes of a table from which on what reading or writing took is given back: Arrow would keep as much for later."""


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
        "columns": _signature(arrow.schema),
        "rows": str(arrow.num_rows),
        "units": json.dumps({field.name: field.metadata[b"unit"].decode() for field in fields}),
        "provenance": json.dumps(plain(provenance), sort_keys=True),
    }
    metadata = {**(arrow.schema.metadata or {}), **{k.encode(): v.encode() for k, v in whole.items()}}
    schema = pa.schema(fields, metadata=metadata)
    schema = schema.with_metadata({**metadata, CHECKSUM: _checksum(schema)})
    with replacing(path) as file:
        pq.write_table(arrow.cast(schema), file, compression="zstd", write_page_checksum=True)
    if arrow.nbytes > LARGE:
        pa.default_memory_pool().release_unused()


def read_parquet(path: Path, columns: Collection[str] | None = None) -> DataFrame:
    """The table at `path`; VidtrackError where it is not Parquet, or not as it was written.

    columns   those that are wanted, where there are any of them; None: all
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    with _whole(path), pq.ParquetFile(path, page_checksum_verification=True) as file:
        threads = file.metadata.num_rows >= THREADS_FROM
        some = None if columns is None else [name for name in file.schema_arrow.names if name in columns]
        arrow = file.read(columns=some, use_threads=threads)
        names = arrow.schema.names
        whole = arrow.schema if some is None else file.read_row_groups([]).schema
        written = whole.metadata or {}
        signature = written.get(b"columns")
        # a page's head, which says how many values it holds, has no checksum
        if arrow.num_rows != file.metadata.num_rows or str(arrow.num_rows).encode() != written.get(
            b"rows", str(arrow.num_rows).encode()
        ):
            raise ValueError("its rows are not those that were written")
        table: DataFrame = arrow.to_pandas(use_threads=threads)
        if arrow.nbytes > LARGE:
            del arrow
            pa.default_memory_pool().release_unused()
        renamed = list(table.columns) != names
        if renamed or (signature is not None and signature.decode() != _signature(whole)):
            raise ValueError("its columns are not those that were written")
        _refuse_changed(whole)
        return table


def _signature(schema: Any) -> str:
    """The names and types of a table's columns as one line: pages have checksums of their own, names have none.

    Parquet names what lists hold `element`, Arrow `item`: they are the same.
    """
    return json.dumps([[field.name, str(field.type).replace("<element:", "<item:")] for field in schema])


def _checksum(schema: Any) -> bytes:
    """The SHA-256 of all that a table says beside its values: units, provenance, how pandas held each column.

    Numbers have the checksums of their pages; a flipped bit here would change a unit, or make a float64 a Float64.
    """
    said = {name: text for name, text in (schema.metadata or {}).items() if name != CHECKSUM}
    units = [(field.metadata or {}).get(b"unit", b"") for field in schema]
    return hashlib.sha256(repr((sorted(said.items()), units)).encode()).hexdigest().encode()


def _refuse_changed(schema: Any) -> None:
    written = (schema.metadata or {}).get(CHECKSUM)
    if written is not None and written != _checksum(schema):
        raise ValueError("its units or its provenance are not those that were written")


@contextmanager
def _whole(path: Path) -> Iterator[None]:
    """Whatever a damaged table raises becomes one line; a file that cannot be opened keeps its own error."""
    import pyarrow as pa

    try:
        yield
    except (pa.ArrowException, ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise damaged(path, "not a Parquet table, or damaged", error) from None
    except OSError as error:
        if error.errno is not None:
            raise
        raise damaged(path, "not a Parquet table, or damaged", error) from None


def read_units(path: Path) -> dict[str, str]:
    """The unit of every column of the Parquet table at `path`."""
    import pyarrow.parquet as pq

    with _whole(path):
        schema = pq.read_schema(path)
        _refuse_changed(schema)
        return dict(json.loads((schema.metadata or {}).get(b"units", b"{}")))


def write_csv(path: Path, table: DataFrame) -> None:
    """Write a table as CSV; NaN is an empty cell."""
    with replacing(path) as file:
        file.write(table.to_csv(index=False, lineterminator="\n").encode())


def read_csv(path: Path, columns: Columns, *, others: str = "forbid", units: str = "") -> DataFrame:
    """A CSV file that a person wrote as a table; see `checked_csv` for what is checked and what `line` is."""
    import pandas as pd

    checked = checked_csv(path, columns, others=others, units=units)
    return pd.DataFrame(
        {name: pd.Series(c, dtype="float64" if name in columns.numbers else None) for name, c in checked.items()}
    )


def read_points(path: Path, units: str = "") -> DataFrame:
    """Surveyed points: tag, x, y, z, sigma (NaN where the file has none); world units, the experiment's `units`."""
    table = read_csv(path, POINTS, units=units)
    if "sigma" not in table:
        table.insert(4, "sigma", math.nan)
    return table


def read_picks(path: Path, camera: str | None = None) -> DataFrame:
    """Where tagged points roughly are: camera, tag, Xf, Yf (px), sd (px); those of one camera where it is named.

    sd is NaN but for points that were placed by hand, where there is no ball to measure.
    """
    table = read_csv(path, PICKS)
    if "sd" not in table:
        table["sd"] = math.nan
    bad = table[table["sd"] <= 0]
    if len(bad):
        raise VidtrackError(
            *(f"{path}, line {n}: sd must be positive. Leave sd empty for a ball." for n in bad["line"])
        )
    return _of_camera(table, camera)


def read_targets(path: Path, camera: str, size: tuple[int, int]) -> DataFrame:
    """Where a camera's boxes start: camera, target, Xf, Yf (px), width, height (px, NaN: the config's box).

    size   px, of the camera's picture; VidtrackError, a line each, for boxes whose middle lies outside of it
    """
    table = read_csv(path, TARGETS)
    for name in ("width", "height"):
        if name not in table:
            table[name] = math.nan
    table = _of_camera(table, camera)
    outside = ~(table["Xf"].between(0, size[0] - 1) & table["Yf"].between(0, size[1] - 1))
    if outside.any():
        raise VidtrackError(
            *(
                f"{path}, line {row.line}: target {row.target} at ({row.Xf:g}, {row.Yf:g}) is outside the picture of "
                f"{camera}, {size[0]} x {size[1]} px. Correct Xf and Yf."
                for row in table[outside].itertuples()
            )
        )
    return table


def read_truth(path: Path, units: str = "") -> DataFrame:
    """Where targets truly were, by a better instrument: time_s, target, x, y, z; world units, the experiment's."""
    return read_csv(path, TRUTH, units=units)


def _of_camera(table: DataFrame, camera: str | None) -> DataFrame:
    return table if camera is None else table[table["camera"] == camera].reset_index(drop=True)

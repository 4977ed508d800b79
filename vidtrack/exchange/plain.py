"""CSV and Parquet: vidtrack's own tables, with their units in a file beside them.

origin, axes    as everywhere in vidtrack (docs/conventions.md): world axes of points.csv, frame buffer px
units           of each column in <run>_units.json: {file: {column: unit}}; Parquet has them in its schema too
angles          bodies: degrees, intrinsic z-y'-x'' (yaw, then pitch, then roll), and the quaternion
missing         CSV: an empty cell; Parquet: NaN. `flag` says why
numbers         CSV: the shortest text that gives the same number back
"""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING

import numpy as np

from vidtrack.exchange.measured import Run, Written
from vidtrack.files.tables import UNITS

if TYPE_CHECKING:
    from pandas import DataFrame

EXPORTED = ("trajectories", "kinematics", "bodies", "motions")
DEGREES = ("roll", "pitch", "yaw")
OWN = {
    **{f"sigma_{a}": "deg" for a in DEGREES},
    **dict.fromkeys(("surge", "sway", "heave", "sigma_surge", "sigma_sway", "sigma_heave"), "world"),
    **{f"sigma_v{a}": "world/s" for a in "xyz"},
    **{f"sigma_a{a}": "world/s^2" for a in "xyz"},
}
"""Units of columns that `files.tables.UNITS` does not know."""


def units_of(table: DataFrame, units: str) -> dict[str, str]:
    """The unit of each column of a result's table; empty where it has none."""
    known = {**UNITS, **OWN}
    return {str(name): known.get(str(name), "").replace("world", units) for name in table.columns}


def write_csv(run: Run) -> Written:
    """Each table of the run as CSV; a covariance stands row by row in columns covariance_1_1 ... covariance_6_6."""
    files = {}
    for name, table in _tables(run).items():
        text = _flat(table).to_csv(index=False, lineterminator="\n")
        files[f"{run.name}_{name}.csv"] = text.encode()
    return Written({**files, **_sidecar(run, ".csv")}, [])


def write_parquet(run: Run) -> Written:
    """Each table of the run as Parquet, units and provenance in its schema."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    files = {}
    for name, table in _tables(run).items():
        arrow = pa.Table.from_pandas(table, preserve_index=False)
        units = units_of(table, run.units)
        schema = pa.schema(
            [field.with_metadata({"unit": units[field.name]}) for field in arrow.schema],
            {**(arrow.schema.metadata or {}), b"units": json.dumps(units).encode()}
            | {b"provenance": json.dumps(dict(run.provenance), sort_keys=True).encode()},
        )
        buffer = io.BytesIO()
        pq.write_table(arrow.cast(schema), buffer, compression="zstd")
        files[f"{run.name}_{name}.parquet"] = buffer.getvalue()
    return Written({**files, **_sidecar(run, ".parquet")}, [])


def _tables(run: Run) -> dict[str, DataFrame]:
    return {name: run.tables[name] for name in EXPORTED if name in run.tables}


def _flat(table: DataFrame) -> DataFrame:
    """A table in which a column of matrices is a column an element."""
    import pandas as pd

    if "covariance" not in table:
        return table
    rows = [np.asarray(row, float).ravel() for row in table["covariance"]]
    whole = np.array(rows).reshape(len(rows), 36) if rows else np.zeros((0, 36))
    names = [f"covariance_{i}_{j}" for i in range(1, 7) for j in range(1, 7)]
    return pd.concat([table.drop(columns="covariance"), pd.DataFrame(whole, columns=names, index=table.index)], axis=1)


def _sidecar(run: Run, ending: str) -> dict[str, bytes]:
    units = {}
    for name, table in _tables(run).items():
        own = _flat(table) if ending == ".csv" else table
        units[f"{run.name}_{name}{ending}"] = units_of(own, run.units)
    record = {"units": units, "length": run.units, "vidtrack": run.version}
    return {f"{run.name}_units.json": (json.dumps(record, indent=1, ensure_ascii=False) + "\n").encode()}

"""The same experiment in other circumstances: each result must have the same bytes.

    PYTHONPATH=. python benchmarks/same_bytes.py [--of plain whole board wand old old_points] [--only "another folder"]

A small experiment is processed once by two cores, and once more in a fresh copy in each circumstance. All files under
results/ are compared (pages, tables, records, pictures, accounts) but for those that may differ:

    results/logs/         what was said of problems
    results/.benchmarks/  how long jobs took, and their memory

Where a processor has no fused multiply-add, or OpenBLAS multiplies matrices as for another one, sums are rounded
otherwise: there the numbers in tables and records are compared, and the largest difference is reported, in units of the
largest of its column or vector.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from benchmarks.faults.laboratories import LABORATORIES

HOUSE = Path(__file__).resolve().parent.parent
MAY_DIFFER = ("logs", ".benchmarks")
DIGITS = 1e-6
"""Largest difference, relative, of a number that another processor computes, of the largest in its column."""
MATRICES = ("gradients", "curvatures")
"""Lists of matrices whose components all have one unit: a row of them may be nought but for rounding."""
ROUNDING = 1e-14
"""Differences up to this are none: the mean of what swings about nought is a rounding error of either sign."""

NO_FMA = {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}
"""NumPy's names since 2.4: those that it does not know, AVX2 among them, it passes over without a word."""


class Circumstance(NamedTuple):
    """What is otherwise: variables, options of Snakemake, targets of a call before, the folder's name, the umask."""

    variables: Mapping[str, str] = MappingProxyType({})
    options: tuple[str, ...] = ("--cores", "2")
    first: tuple[str, ...] = ()
    folder: str = "lab"
    umask: int = 0o022
    numbers: bool = False


CIRCUMSTANCES: dict[str, Circumstance] = {
    "1 core": Circumstance(options=("--cores", "1")),
    "4 cores": Circumstance(options=("--cores", "4")),
    "jobs in another order": Circumstance(first=("--until", "track"), options=("--cores", "1")),
    "another scheduler": Circumstance(options=("--cores", "2", "--scheduler", "ilp")),
    "another folder": Circumstance(folder="ein anderer Ordner/ö ü/'x y'/lab"),
    "locale C": Circumstance({"LC_ALL": "C", "LANG": "C"}),
    "locale de_DE": Circumstance({"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}),
    "locale tr_TR": Circumstance({"LC_ALL": "tr_TR.UTF-8", "LANG": "tr_TR.UTF-8"}),
    "time zone +14:00": Circumstance({"TZ": "Pacific/Kiritimati"}),
    "hash seed 12345": Circumstance({"PYTHONHASHSEED": "12345"}),
    "umask 077": Circumstance(umask=0o077),
    "another user's name and home": Circumstance({"HOME": "/nonexistent", "USER": "ömer", "LOGNAME": "ömer"}),
    "threads of libraries": Circumstance({"OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"}),
    "a processor without FMA": Circumstance(NO_FMA, numbers=True),
    "products as for Haswell": Circumstance({"OPENBLAS_CORETYPE": "Haswell"}, numbers=True),
    "products as for Zen": Circumstance({"OPENBLAS_CORETYPE": "Zen"}, numbers=True),
    "products as for Prescott": Circumstance({"OPENBLAS_CORETYPE": "Prescott"}, numbers=True),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--of", nargs="*", default=["plain"], choices=list(LABORATORIES))
    parser.add_argument("--only", action="append", choices=list(CIRCUMSTANCES))
    asked = parser.parse_args()
    bad = 0
    for name in asked.of:
        with tempfile.TemporaryDirectory(prefix="same-") as place:
            room = Path(place)
            LABORATORIES[name](room / "raw")
            wanted = processed(room, Circumstance())
            reference = room / "reference"
            (room / "lab").rename(reference)
            print(f"{name}: {len(wanted)} files", flush=True)
            for circumstance in asked.only or CIRCUMSTANCES:
                bad += _compared(room, circumstance, wanted, reference)
    return 1 if bad else 0


def _compared(room: Path, name: str, wanted: dict[str, str], reference: Path) -> bool:
    """Whether files differ; prints a line."""
    own, begun = CIRCUMSTANCES[name], time.monotonic()
    found = processed(room, own)
    other = sorted(path for path in {*wanted, *found} if wanted.get(path) != found.get(path))
    said = "the same bytes" if not other else f"{len(other)} files differ"
    bad = bool(other)
    if other and own.numbers:
        most, where = _largest(reference, room / own.folder, other)
        bad = not most < DIGITS
        said += f", numbers by {most:.1e} at most ({where})"
    elif other:
        said += f": {', '.join(other[:4])}"
    print(f"    {name:32}{said}  ({time.monotonic() - begun:.0f} s)", flush=True)
    shutil.rmtree(room / Path(own.folder).parts[0])
    return bad


def processed(room: Path, own: Circumstance) -> dict[str, str]:
    """The experiment in fresh, processed in a circumstance: the checksum of each file of its results."""
    folder = room / own.folder
    shutil.copytree(room / "raw", folder)
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    variables = (
        os.environ | threads | {"PYTHONPATH": str(HOUSE), "LC_ALL": "C.UTF-8", "TZ": "UTC"} | dict(own.variables)
    )
    command = [sys.executable, "-m", "snakemake", "-s", f"{HOUSE}/Snakefile", "--directory", str(folder)]
    for options in ([*own.first, "--cores", "1"] if own.first else [], list(own.options)):
        if options:
            done = subprocess.run(
                [*command, *options], env=variables, capture_output=True, text=True, check=False, umask=own.umask
            )
            if done.returncode:
                raise SystemExit(done.stdout[-2000:] + done.stderr[-4000:])
    return digests(folder / "results")


def digests(results: Path) -> dict[str, str]:
    """The checksum of each file that may not differ, by its path."""
    found = {}
    for path in sorted(results.rglob("*")):
        name = path.relative_to(results)
        if path.is_file() and name.parts[0] not in MAY_DIFFER:
            found[str(name)] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def _largest(one: Path, other: Path, names: list[str]) -> tuple[float, str]:
    """The largest relative difference of numbers in tables and records, and where; inf where words or sizes differ."""
    most, where = 0.0, "none"
    for name in names:
        if not name.endswith((".parquet", ".json")) or name.startswith("."):
            continue
        for key, a, b in _pairs(one / "results" / name, other / "results" / name):
            if a.shape != b.shape:
                return np.inf, f"{name}: {key}"
            scale = np.nanmax(np.abs(a), initial=0.0) or 1.0
            same = (np.isnan(a) & np.isnan(b)) | (np.abs(a - b) <= ROUNDING)
            off = np.where(same, 0.0, np.abs(a - b) / scale)
            if not off.size or off.max() <= most:
                continue
            most, where = float(off.max()), f"{name}: {key}"
    return most, where


def _pairs(one: Path, other: Path) -> Iterator[tuple[str, Any, Any]]:
    if not (one.exists() and other.exists()):
        yield "is missing", np.zeros(0), np.zeros(1)
    elif one.suffix == ".parquet":
        a, b = pd.read_parquet(one), pd.read_parquet(other)
        for column in a.select_dtypes("number"):
            yield column, a[column].to_numpy(float), b[column].to_numpy(float)
    else:
        a, b = (dict(_leaves(json.loads(path.read_text()))) for path in (one, other))
        for key in a:
            if not key.startswith("/provenance"):
                yield key, np.atleast_1d(a[key]), np.atleast_1d(b.get(key, np.inf))


def _leaves(value: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers by their places; the components of a vector, or of one such matrix, together, for they are as large as it
    is."""
    if place.rpartition("/")[2] in MATRICES and value is not None:
        for k, inner in enumerate(value):
            yield f"{place}/{k}", np.ravel(inner).astype(float)
    elif isinstance(value, list) and value and all(type(one) in (int, float) for one in value):
        yield place, np.array(value, float)
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield from _leaves(inner, f"{place}/{key}")
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from _leaves(inner, f"{place}/{k}")
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield place, float(value)


if __name__ == "__main__":
    sys.exit(main())

"""One bit of a result flipped: read by itself it must be refused, or have the same numbers."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.faults.stages import Count
from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet

READERS: dict[str, Callable[[Path], Any]] = {".json": read_json, ".parquet": read_parquet}


def flipped(folder: Path, times: int, rng: random.Random) -> dict[str, Count]:
    """Each kind of result (the name of its file) so many times, in files of that name by chance; a line a kind."""
    kinds: dict[str, list[Path]] = {}
    for path in sorted((folder / "results").rglob("*")):
        if path.suffix in READERS and not any(part.startswith(".") for part in path.relative_to(folder).parts):
            kinds.setdefault(path.name, []).append(path)
    found = {}
    for name, paths in kinds.items():
        refused, other = 0, []
        for _ in range(times):
            said = _once(rng.choice(paths), rng)
            refused += said is None
            other += [said] if said else []
        print(
            f"{name:28}{times:6d} flipped{refused:6d} refused{times - refused - len(other):6d} the same",
            *other,
            flush=True,
        )
        found[name] = Count(times, refused, other, 0)
    return found


def _once(path: Path, rng: random.Random) -> str | None:
    """Which bit was read as another number; nothing where it was read as it was written; None where it was refused."""
    data, wanted = path.read_bytes(), READERS[path.suffix](path)
    place, bit = rng.randrange(len(data)), rng.randrange(8)
    path.write_bytes(data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1 :])
    try:
        read = READERS[path.suffix](path)
    except VidtrackError:
        return None
    finally:
        path.write_bytes(data)
    return "" if _agree(read, wanted) else f"{path}: bit {bit} of byte {place}"


def _agree(read: Any, wanted: Any) -> bool:
    """Whether all that was written was read; a record may have a key more, which was its checksum's."""
    if isinstance(wanted, pd.DataFrame):
        return read.equals(wanted)
    if isinstance(wanted, Mapping):
        return all(key in read and np.array_equal(read[key], wanted[key]) for key in wanted)
    return bool(read == wanted)

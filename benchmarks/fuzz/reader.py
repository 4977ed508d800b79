"""A reader that is fuzzed, and what became of one mutated file."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np

from benchmarks.fuzz.mutation import mutated, mutated_text
from vidtrack.errors import LINES, LONGEST, VidtrackError


class Reader(NamedTuple):
    """One kind of file.

    make   writes a healthy file, and what it needs beside it, into a folder; the path of what is mutated
    read   reads all that the program reads of the file; of a path as text
    text   whether words and lines are changed, and not bytes alone
    file   the file that is read, where it is another one than what is mutated
    """

    make: Callable[[Path], Path]
    read: Callable[[str], object]
    text: bool = False
    file: str | None = None


def outcome(read: Callable[[str], object], path: Path) -> str:
    """ "read", "refused", or what must not be."""
    try:
        read(str(path))
    except VidtrackError as error:
        lines = error.problems
        good = (
            lines and len(lines) <= LINES + 1 and all(line.isprintable() and len(line) <= LONGEST + 5 for line in lines)
        )
        return "refused" if good else f"not clear lines: {[line[:200] for line in lines[:3]]}"
    except Exception:
        return traceback.format_exc()
    return "read"


def changed(data: bytes, name: str, seed: int, text: bool) -> bytes:
    """The file's bytes as seed number `seed` has them."""
    rng = np.random.default_rng([seed, crc32(name.encode())])
    return (mutated_text if text else mutated)(data, rng)


def tried(folder: Path, name: str, reader: Reader, seeds: range) -> dict[str, int]:
    """Outcome: how often, in this process."""
    path = reader.make(folder)
    data = path.read_bytes()
    target = folder / reader.file if reader.file else path
    found: dict[str, int] = {}
    reader.read(str(target))  # it is healthy
    for seed in seeds:
        path.write_bytes(changed(data, name, seed, reader.text))
        one = outcome(reader.read, target)
        found[one] = found.get(one, 0) + 1
    return found

"""Whether everything is as it was when all was done: then there is nothing to plan, however many runs there are.

Snakemake goes through every job, its inputs and what it remembers of it, to find that none has to run. What that
depends on is here in one checksum: the rules, Snakemake itself, the settings, the files that were found, and each job's
order. Where the checksum is that of the last call that finished all jobs, and all results are still as their accounts
say, the answer is known. Where anything differs, Snakemake plans as usual.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable

from vidtrack.files.atomic import replacing

FILE = "finished"


def checksum_of_plan(rules: str, *parts: object) -> str:
    """What a plan depends on, as a checksum.

    rules   the folder of the rules; parts: whatever else decides what has to run, each with a repr that shows it whole
    """
    digest = hashlib.sha256()
    for path in _files(rules):
        digest.update(f"{os.path.relpath(path, rules)}\0".encode())
        with open(path, "rb") as file:
            digest.update(file.read() + b"\0")
    for part in parts:
        digest.update(f"{part!r}\0".encode())
    return digest.hexdigest()


def note_finished(cache: str, checksum: str) -> None:
    """Remember that all jobs of the plan have been done; where that cannot be written, the next call plans again."""
    try:
        with replacing(os.path.join(cache, FILE)) as file:
            file.write(checksum.encode())
    except OSError:
        return


def is_finished(cache: str, checksum: str, results: Iterable[str], settled: set[str]) -> bool:
    """Whether the plan is the one that was finished last, and each of `results` is among those that are `settled`."""
    try:
        with open(os.path.join(cache, FILE), "rb") as file:
            if file.read() != checksum.encode():
                return False
    except OSError:
        return False
    return settled.issuperset(results)


def _files(folder: str) -> list[str]:
    found = []
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith((".", "__"))]
        found += [os.path.join(place, name) for name in names if name == "Snakefile" or name.endswith(".smk")]
    return sorted(found)

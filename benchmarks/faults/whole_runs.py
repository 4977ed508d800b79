"""A whole run killed, stopped, hindered or disturbed at a random moment, and then called again, plainly.

A lock that is left is not removed by hand. A trial is lost where the second call fails, leaves other bytes than the
undisturbed run, or leaves a half-written file, and where a process of either call is still there a minute after it.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from benchmarks.faults.hits import FAULTS
from benchmarks.faults.processes import HOUSE, command, end_of_session
from benchmarks.faults.stages import Count

PLAIN = (".parquet", ".json", ".csv", ".html", ".svg", ".png")
"""Endings of results; logs, benchmarks and Snakemake's own records are not results."""


class Said(NamedTuple):
    """A call of Snakemake.

    lines   those of vidtrack and those of errors
    hit     what the fault met; "" where it says nothing of it
    after   s until the last of its processes had ended, and those that had not
    """

    code: int
    seconds: float
    lines: list[str]
    hit: str
    after: float
    orphans: list[int]


def disturbed(raw: Path, room: Path, faults: list[str], trials: int, rng: random.Random) -> dict[str, Count]:
    """Each fault in turn upon a run of an experiment, `trials` in all; a line a trial."""
    calm = room / "calm"
    shutil.copytree(raw, calm)
    before = _run(calm)
    if before.code:
        raise SystemExit("\n".join(before.lines))
    wanted = digests(calm)
    print(f"undisturbed: {before.seconds:.0f} s, {len(wanted)} results", flush=True)
    found = {fault: Count(0, 0, [], 0) for fault in faults}
    for k in range(trials):
        fault = faults[k % len(faults)]
        folder = room / "trial"
        shutil.copytree(raw, folder)
        problems, said = _trial(folder, fault, before.seconds, wanted, rng)
        one = found[fault]
        lost, most = [*one.lost, *problems], max(one.most, len(said.lines))
        found[fault] = Count(one.times + 1, one.hit + (said.code != 0), lost, most)
        hit = f" ({said.hit})" if said.hit else ""
        lived_on = f", processes until {said.after:.1f} s after it" if said.after > 1 else ""
        print(f"{k + 1}/{trials} {fault}{hit}: {'; '.join(problems) or 'nothing lost'}{lived_on}", flush=True)
        for line in said.lines:
            print(f"    {line[:200]}", flush=True)
        shutil.rmtree(folder)
    return found


def _run(folder: Path, fault: Callable[[subprocess.Popen[str], Path], str | None] | None = None) -> Said:
    """Snakemake over a folder, from its beginning to its end; a fault is called beside it."""
    begun = time.monotonic()
    environment = os.environ | {"PYTHONPATH": str(HOUSE), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    said = folder.with_name("said")
    with said.open("w") as out:
        running = subprocess.Popen(
            command(folder), stdout=out, stderr=out, text=True, start_new_session=True, env=environment
        )
        hit = (fault(running, folder) or "") if fault is not None else ""
        code = running.wait()
        ended = time.monotonic()
        orphans = end_of_session(running.pid)
    lines = [line for line in said.read_text().splitlines() if line.startswith("vidtrack:") or "Error" in line]
    return Said(code, time.monotonic() - begun, lines, hit, time.monotonic() - ended, orphans)


def processed(folder: Path) -> None:
    """The experiment after an undisturbed run."""
    if (said := _run(folder)).code:
        raise SystemExit("\n".join(said.lines))


def _trial(
    folder: Path, fault: str, seconds: float, wanted: dict[str, str], rng: random.Random
) -> tuple[list[str], Said]:
    """What was lost (nothing: an empty list), and what the user read of the disturbed run."""
    moment = rng.uniform(0.2, 0.95) * seconds
    said = _run(folder, lambda running, where: FAULTS[fault](running, where, moment, rng))
    problems = [f"still there after a minute: {said.orphans}"] if said.orphans else []
    again = _run(folder)
    if again.orphans:
        problems.append(f"still there a minute after the second call: {again.orphans}")
    if again.code:
        problems.append(f"the second call ended with {again.code}: {' | '.join(again.lines[:3])}")
    found = digests(folder)
    if missing := set(wanted) - set(found):
        problems.append(f"missing: {', '.join(sorted(missing)[:3])} ({' | '.join(again.lines[:3])})")
    if other := [name for name in wanted if name in found and found[name] != wanted[name]]:
        problems.append(f"other bytes: {', '.join(sorted(other)[:3])}")
    if left := [str(path.relative_to(folder)) for path in folder.rglob("*.partial*")]:
        problems.append(f"left: {', '.join(left[:3])}")
    return problems, said


def digests(folder: Path) -> dict[str, str]:
    results = folder / "results"
    found = {}
    for path in sorted(results.rglob("*")):
        name = path.relative_to(results)
        aside = any(part.startswith(".") or part in ("logs", "benchmarks") for part in name.parts)
        if path.is_file() and path.suffix in PLAIN and not aside:
            found[str(name)] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found

"""What killed, stopped, hindered and disturbed runs leave: called again, each result must be there, byte for byte.

    PYTHONPATH=. python -m benchmarks.faults stages [--times 100] [--seed 1] [--rule track] [--fault SIGTERM]
    PYTHONPATH=. python -m benchmarks.faults runs [--times 40] [--seed 1] [--fault kill-snakemake]
    PYTHONPATH=. python -m benchmarks.faults flips [--times 300] [--seed 1] [--of plain]

stages  five small experiments, which together have a job of every rule, are processed once. Then a job of each rule is
        disturbed in a forked process, `--times` times by each fault. Some faults need root.
runs    an experiment of 21 jobs is processed once; then, `--times` times in all, a fault hits Snakemake at work on a
        fresh copy, and it is called again.
flips   an experiment is processed once; then, `--times` times for each kind of table and record, one bit of one is
        flipped and it is read by itself. "Failed": refused; "lost": read as another number.
A line a rule or a trial; then for each fault how often, in how many trials the job did not end well, how many were
lost, and how many lines the user read at most.
"""

from __future__ import annotations

import argparse
import random
import shutil
import sys
import tempfile
from pathlib import Path

from benchmarks.faults import flips, rendering, stages, whole_runs
from benchmarks.faults.laboratories import LABORATORIES, plain
from benchmarks.season import HOUSE, Planned, planned


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("stages", "runs", "flips"))
    parser.add_argument("--times", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fault", action="append", choices=[*stages.FAULTS, *whole_runs.FAULTS])
    parser.add_argument("--rule", action="append", help="stages: these rules alone")
    parser.add_argument(
        "--of", action="append", choices=list(LABORATORIES), help="stages, flips: these experiments alone"
    )
    parser.add_argument("--keep", type=Path, help="a folder where the experiments are made, or lie already; it stays")
    asked = parser.parse_args()
    rng = random.Random(asked.seed)
    room = Path(tempfile.mkdtemp(prefix="faults-"))
    room.chmod(0o755)
    try:
        if asked.what == "runs":
            plain(room / "raw")
            faults = asked.fault or list(whole_runs.FAULTS)
            found = whole_runs.disturbed(room / "raw", room, faults, asked.times, rng)
        elif asked.what == "flips":
            name = (asked.of or ["plain"])[0]
            LABORATORIES[name](room / name)
            whole_runs.processed(room / name)
            found = flips.flipped(room / name, asked.times, rng)
        else:
            faults = asked.fault or list(stages.FAULTS)
            found = _stages(room, faults, asked.times, asked.rule, asked.of or list(LABORATORIES), rng, asked.keep)
    finally:
        shutil.rmtree(room, ignore_errors=True)
    print(f"\n{'fault':36}{'times':>7}{'failed':>8}{'lost':>6}{'lines':>7}")
    for fault, one in found.items():
        print(f"{fault:36}{one.times:7d}{one.hit:8d}{len(one.lost):6d}{one.most:7d}")
    return 1 if any(one.lost for one in found.values()) else 0


def _stages(
    room: Path,
    faults: list[str],
    times: int,
    rules: list[str] | None,
    of: list[str],
    rng: random.Random,
    keep: Path | None,
) -> dict[str, stages.Count]:
    """Each fault upon a job of each rule of the laboratories; a line a rule."""
    stages.load_libraries()
    whole = {fault: stages.Count(0, 0, [], 0) for fault in faults}
    seen: set[str] = set()

    def add(rule: str, found: dict[str, stages.Count]) -> None:
        times = sum(one.times for one in found.values())
        hit = sum(one.hit for one in found.values())
        lost = [line for one in found.values() for line in one.lost]
        print(f"{rule:20}{times:7d}{hit:8d}{len(lost):6d}  {' | '.join(lost[:3])}", flush=True)
        for fault, one in found.items():
            before = whole[fault]
            whole[fault] = stages.Count(
                before.times + one.times, before.hit + one.hit, before.lost + one.lost, max(before.most, one.most)
            )

    if rules is None or "render" in rules:
        add("render", rendering.disturbed(room, faults, times, rng))
    for name in of if rules != ["render"] else ():
        folder = (keep or room) / name
        if not folder.exists():
            LABORATORIES[name](folder)
            whole_runs.processed(folder)
        for job in _one_of_each_rule(folder, seen, rules):
            add(job.rule, stages.disturbed(folder, job, faults, times, rng))
        if not keep:
            shutil.rmtree(folder)
    return whole


def _one_of_each_rule(folder: Path, seen: set[str], rules: list[str] | None) -> list[Planned]:
    """A job of each rule that no experiment before had."""
    chosen = {}
    for job in planned(folder, HOUSE, "--forceall"):
        if job.rule not in seen and (rules is None or job.rule in rules):
            chosen[job.rule] = job
    seen.update(chosen)
    return list(chosen.values())


if __name__ == "__main__":
    sys.exit(main())

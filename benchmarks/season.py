"""A season: many runs of two cameras, planned, changed and added to.

    PYTHONPATH=. python benchmarks/season.py plan --runs 100 300 1000
    PYTHONPATH=. python benchmarks/season.py change --runs 100 [--house ANOTHER/CHECKOUT]
    PYTHONPATH=. python benchmarks/season.py export --runs 20

plan      how long `snakemake -n` takes where nothing is to do. Results and accounts are pretended: planning reads
          nothing of a result but its checksum. Then a setting of one run is changed: which jobs are to be done, and
          so which pages are written again.
change    one run of a minute is rendered and processed; it stands, with its results, under other names as every run of
          the season. Then one camera's Cx is fixed elsewhere, and a run is added: how long until everything is
          consistent again, and by which jobs. What the same job takes shows how fast the machine is that day.
export    one short run is processed, and its results stand for those of every run; three formats of each are written by
          two jobs at a time. Then a setting of one run is changed: which exports are written again, and which files are
          others.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from vidtrack.simulate.laboratory import set_up
from vidtrack.simulate.scenario import scenario_from
from vidtrack.workflow.provenance import Account, Order, write_account

HOUSE = Path(__file__).resolve().parent.parent


class Planned(NamedTuple):
    """A job as Snakemake would call it."""

    rule: str
    order: Order
    account: str
    arguments: list[str]
    inputs: list[str]
    outputs: list[str]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("plan", "change", "export"))
    parser.add_argument("--runs", type=int, nargs="+", default=[100])
    parser.add_argument("--seconds", type=float, default=60.0, help="length of a run, for `change`")
    parser.add_argument("--house", type=Path, default=HOUSE, help="the checkout whose workflow is measured")
    asked = parser.parse_args()
    room = Path(tempfile.mkdtemp(prefix="season-"))
    try:
        for runs in asked.runs:
            folder = room / f"season{runs}"
            if asked.what == "plan":
                _plan(folder, runs, asked.house)
            elif asked.what == "export":
                _export(folder, runs, asked.house)
            else:
                _change(folder, runs, asked.seconds, asked.house)
            shutil.rmtree(folder)
    finally:
        shutil.rmtree(room, ignore_errors=True)


def pretended_season(folder: Path, runs: int, house: Path) -> int:
    """Make a season of which everything is done, in a new folder; how many jobs it has.

    Snakemake has no record of it, as of a folder that came from another computer.
    """
    _film(folder, 0.3)
    _multiply(folder, runs)
    jobs = list(planned(folder, house))
    for job in jobs:
        _pretend(folder, job, lambda path: path.write_bytes(b"pretended"))
    used = os.times()
    if "Nothing to be done" not in (said := _snakemake(folder, house)):
        raise SystemExit(f"{said}\nsomething was to be done")
    print(
        f"{runs} runs: planned with nothing remembered in {_processor_time(used):.1f} s of processor time", flush=True
    )
    return len(jobs)


def _plan(folder: Path, runs: int, house: Path) -> None:
    jobs = pretended_season(folder, runs, house)
    took = []
    for _ in range(3):
        begun, used = time.monotonic(), os.times()
        said = _snakemake(folder, house, "-n")
        took.append((_processor_time(used), time.monotonic() - begun))
        if "Nothing to be done" not in said:
            raise SystemExit(f"{said}\nsomething was to be done")
    processor, wall = min(took)
    print(f"{runs} runs, {jobs} jobs: planned in {wall:.1f} s ({processor:.1f} s of processor time)", flush=True)
    config = yaml.safe_load((folder / "config.yaml").read_text())
    config.setdefault("runs", {})["test0001"] = {"detect": {"min_pixels": 5}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    counted = _counted(_snakemake(folder, house, "-n", "-q", "rules"))
    print("a setting of one run changed: " + ", ".join(f"{n} {rule}" for rule, n in counted.items()), flush=True)


def _change(folder: Path, runs: int, seconds: float, house: Path) -> None:
    processed_season(folder, runs, seconds, house)
    _configure(folder, cameras=_config(folder)["cameras"] | {"cam1": {"calibration": {"fix": {"Cx": 262.5}}}})
    _run(folder, house, "Cx of one camera fixed")
    shutil.copytree(folder / "runs/pluck", folder / "runs/one-more")  # one more link would be news of all the others
    _run(folder, house, "one more run")
    _run(folder, house, "nothing to do")


def processed_season(folder: Path, runs: int, seconds: float, house: Path) -> None:
    """Process one run; its results, as links, stand for those of all others."""
    _film(folder, seconds)
    _run(folder, house, "one run")
    _multiply(folder, runs)
    _pretend_runs(folder, house)
    _run(folder, house, f"the pages of {runs} runs")


def _pretend_runs(folder: Path, house: Path) -> None:
    """Results of the first run, and accounts, for all jobs that make something of one other run."""
    for job in planned(folder, house):
        named = re.search(r"results/(?:runs/|report/run_)(test\d+)", job.outputs[0])
        if named:
            _pretend(folder, job, lambda path, name=named[1]: os.link(str(path).replace(name, "pluck"), path))


def _export(folder: Path, runs: int, house: Path, formats: tuple[str, ...] = ("c3d", "netcdf", "qtm")) -> None:
    processed_season(folder, runs, 1.0, house)
    _configure(folder, export=list(formats))
    _run(folder, house, f"{len(formats)} formats of {runs} runs")
    before = _exported(folder)
    _configure(folder, runs={"test0001": {"max_miss": 0.5}})
    _run(folder, house, "a setting of one run changed")
    after = _exported(folder)
    again = [path for path in after if after[path] != before[path]]
    runs_again = sorted({path.parts[0] for path in again})
    print(f"{len(after)} files of {len({path.parts[0] for path in after})} runs")
    print(f"written again: {len(again)}, of {runs_again}")


def _config(folder: Path) -> dict[str, Any]:
    return yaml.safe_load((folder / "config.yaml").read_text())


def _configure(folder: Path, **more: object) -> None:
    (folder / "config.yaml").write_text(yaml.safe_dump(_config(folder) | more))


def _exported(folder: Path) -> dict[Path, int]:
    """The files of other programs, and when each was written."""
    room = folder / "results/runs"
    return {path.relative_to(room): path.stat().st_mtime_ns for path in room.glob("*/export/**/*") if path.is_file()}


def _film(folder: Path, seconds: float) -> None:
    scene = yaml.safe_load((HOUSE / ".test/small.yaml").read_text())
    scene["runs"]["pluck"]["duration_s"] = seconds
    del scene["runs"]["pluck"]["reference"]
    set_up(scenario_from(scene, "scenario"), str(folder), threads=2)


def _multiply(folder: Path, runs: int) -> None:
    """The first run under other names; its recordings are links, of which each is read as a file of its own."""
    for k in range(1, runs):
        shutil.copytree(folder / "runs/pluck", folder / f"runs/test{k:04d}", copy_function=os.link)


def snakemake_command(folder: Path, house: Path, *more: str) -> list[str]:
    command = [sys.executable, "-m", "snakemake", "-s", f"{house}/Snakefile", "--profile", f"{house}/profiles/default"]
    return [*command, "--directory", str(folder), "--cores", "2", *more]


def _snakemake(folder: Path, house: Path, *more: str) -> str:
    environment = os.environ | {"PYTHONPATH": str(house), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        snakemake_command(folder, house, *more), env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)
    return done.stdout + done.stderr


def _processor_time(before: os.times_result) -> float:
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def _run(folder: Path, house: Path, what: str) -> None:
    """Process what is to be done; say how long it took, what was done, and by which jobs."""
    begun, used, since = time.monotonic(), os.times(), time.time()
    said = _snakemake(folder, house)
    wall, processor = time.monotonic() - begun, _processor_time(used)
    load = os.getloadavg()[0]
    done = ", ".join(f"{n} {rule}" for rule, n in sorted(_counted(said).items()))
    print(
        f"{what}: {wall:.1f} s, {processor:.1f} s of processor time (load {load:.1f}): {done or 'nothing'}", flush=True
    )
    by_rule = _used_by_jobs(folder, since)
    if by_rule:
        each = ", ".join(f"{rule} {sum(took) / len(took):.3f}" for rule, took in sorted(by_rule.items()))
        print(f"  jobs {sum(map(sum, by_rule.values())):.1f} s of processor time; each: {each}", flush=True)


def _used_by_jobs(folder: Path, since: float) -> dict[str, list[float]]:
    """Processor time of jobs by rule, s, as Snakemake's benchmarks that were written since then have it."""
    place, used = folder / "results/.benchmarks", dict[str, list[float]]()
    for path in place.rglob("*.tsv"):
        if path.stat().st_mtime >= since:
            names, values = (line.split("\t") for line in path.read_text().splitlines()[:2])
            took = dict(zip(names, values, strict=True))["cpu_time"]
            rule = path.relative_to(place).parts[0].removesuffix(".tsv")
            used.setdefault(rule, []).append(float(took) if took not in ("-", "NA") else 0.0)
    return used


def _counted(said: str) -> dict[str, int]:
    """Jobs by rule, of Snakemake's own table."""
    return {
        rule: int(n) for rule, n in re.findall(r"^(\w+) +(\d+)$", said, re.MULTILINE) if rule not in ("all", "total")
    }


def planned(folder: Path, house: Path, *more: str) -> Iterator[Planned]:
    """The jobs that Snakemake would run, in its order."""
    said = _snakemake(folder, house, "-n", "-p", *more)
    for command in re.findall(r"^Shell command: (.*?)(?=^\[|^$|\Z)", said, re.MULTILINE | re.DOTALL):
        words = shlex.split(command)
        if "vidtrack" not in words:  # rule `all` does nothing
            continue
        at = words.index("vidtrack")
        order, rule = Order(*words[2:5]), words[at + 1]
        inputs, outputs, account, option = [], [], "", ""
        for word in words[at + 2 :]:
            if word.startswith("--"):
                option, name = word, ""
            elif option == "--account":
                account = word
            elif option in ("--input", "--output") and not name:
                name = word
            elif option in ("--input", "--output"):
                (inputs if option == "--input" else outputs).append(word)
        yield Planned(rule, order, account, words[at + 1 :], inputs, outputs)


def _pretend(folder: Path, job: Planned, make: Callable[[Path], object]) -> None:
    """Make a job's outputs, and the account that it would have written."""
    for name in job.outputs:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        make(path)
    results = [name for name in job.inputs if name.startswith("results/")]
    used = {name: _checksum(folder / name) for name in results}
    made = {name: _checksum(folder / name) for name in job.outputs}
    write_account(str(folder / job.account), Account(job.order, used, made))


def _checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else hashlib.sha256(b"pretended").hexdigest()


if __name__ == "__main__":
    main()

"""A whole run killed, stopped, hindered or disturbed at a random moment, and then called again, plainly.

A lock that is left is not removed by hand. A trial is lost where the second call fails, leaves other bytes than the
undisturbed run, or leaves a half-written file.
"""

from __future__ import annotations

import hashlib
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import yaml

from benchmarks.faults.stages import Count

HOUSE = Path(__file__).resolve().parents[2]
PLAIN = (".parquet", ".json", ".csv", ".html", ".svg", ".png")
"""Endings of results; logs, benchmarks and Snakemake's own records are not results."""


class Said(NamedTuple):
    code: int
    seconds: float
    lines: list[str]  # those of vidtrack and those of errors


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
        print(f"{k + 1}/{trials} {fault}: {'; '.join(problems) or 'nothing lost'}", flush=True)
        for line in said.lines:
            print(f"    {line[:200]}", flush=True)
        shutil.rmtree(folder)
    return found


def _command(folder: Path) -> list[str]:
    return [sys.executable, "-m", "snakemake", "-s", f"{HOUSE}/Snakefile", "--directory", str(folder), "--cores", "2"]


def _run(folder: Path, fault: Callable[[subprocess.Popen[str], Path], None] | None = None) -> Said:
    """Snakemake over a folder, from its beginning to its end; a fault is called beside it."""
    begun = time.monotonic()
    environment = os.environ | {"PYTHONPATH": str(HOUSE), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    said = folder.with_name("said")
    with said.open("w") as out:
        running = subprocess.Popen(
            _command(folder), stdout=out, stderr=out, text=True, start_new_session=True, env=environment
        )
        if fault is not None:
            fault(running, folder)
        code = running.wait()
        _end_of_session(running.pid)
    lines = [line for line in said.read_text().splitlines() if line.startswith("vidtrack:") or "Error" in line]
    return Said(code, time.monotonic() - begun, lines)


def processed(folder: Path) -> None:
    """The experiment after an undisturbed run."""
    if (said := _run(folder)).code:
        raise SystemExit("\n".join(said.lines))


def _end_of_session(leader: int) -> None:
    """Wait for what the session's leader left running, as a person does who sees the machine still at work."""
    for _ in range(600):
        if not _session(leader):
            return
        time.sleep(0.1)


def _session(leader: int) -> list[int]:
    """Processes of a session that are not dead."""
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                fields = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == leader and fields[0] != "Z":
                found.append(int(entry))
    return found


def _trial(
    folder: Path, fault: str, seconds: float, wanted: dict[str, str], rng: random.Random
) -> tuple[list[str], Said]:
    """What was lost (nothing: an empty list), and what the user read of the disturbed run."""
    moment = rng.uniform(0.2, 0.95) * seconds
    said = _run(folder, lambda running, where: FAULTS[fault](running, where, moment, rng))
    problems = []
    again = _run(folder)
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


def _signal_all(number: int) -> Callable[..., None]:
    def fault(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
        time.sleep(moment)
        if running.poll() is None:
            os.killpg(running.pid, number)

    return fault


def _kill_snakemake(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    time.sleep(moment)
    running.kill()


def _terminate_snakemake(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    time.sleep(moment)
    running.terminate()


def _kill_stage(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """Any process that Snakemake started, at work just then."""
    time.sleep(moment)
    for _ in range(200):
        others = [pid for pid in _session(running.pid) if pid != running.pid]
        if others or running.poll() is not None:
            break
        time.sleep(0.02)
    else:
        return
    for pid in rng.sample(others, min(1, len(others))):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            return


def _second_call(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """A second call while the first one runs."""
    time.sleep(moment)
    subprocess.run(_command(folder), env=os.environ | {"PYTHONPATH": str(HOUSE)}, capture_output=True, check=False)


def _tweak_and_back(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """The config is edited while it is worked on; then the user thinks better of it."""
    path = folder / "config.yaml"
    before = path.read_text()
    config = yaml.safe_load(before)
    config.setdefault("detect", {})["threshold"] = 90
    time.sleep(moment)
    path.write_text(yaml.safe_dump(config))
    subprocess.run(
        [*_command(folder), "-n"], env=os.environ | {"PYTHONPATH": str(HOUSE)}, capture_output=True, check=False
    )
    running.wait()
    path.write_text(before)


def _full_disk(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """From a moment on no process may write a file of more than a few thousand bytes."""
    time.sleep(moment)
    for pid in _session(running.pid):
        try:
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (3000, 3000))
        except (ProcessLookupError, PermissionError):
            continue


def _read_only_results(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """A result's folder is replaced by a file where it would be written, until the run has ended."""
    time.sleep(moment)
    places = [path for path in (folder / "results").rglob("*") if path.is_dir() and not path.name.startswith(".")]
    if not places:
        return
    place = rng.choice(places)
    aside = place.with_name(f"{place.name}-aside")
    try:
        place.rename(aside)
        place.write_text("")
    except OSError:
        return
    running.wait()
    place.unlink()
    aside.rename(place)


def _clock_jumps(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """Every file's date becomes another one, up to a year off, before or after."""
    time.sleep(moment)
    for path in folder.rglob("*"):
        with suppress(OSError):
            when = time.time() + rng.uniform(-3e7, 3e7)
            os.utime(path, (when, when), follow_symlinks=False)


def _recording_replaced(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """A recording becomes another one while it is worked on, and is put back before the second call."""
    time.sleep(moment)
    path, other = rng.sample(sorted((folder / "runs").rglob("cam*.*")), 2)
    before = folder / "before"
    path.rename(before)
    shutil.copy(other, path)
    running.wait()
    before.rename(path)


def _read_only(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """The results become a file system that cannot be written, until the run has ended. Needs root."""
    time.sleep(moment)
    results = folder / "results"
    results.mkdir(exist_ok=True)
    subprocess.run(["mount", "--bind", results, results], check=True)
    try:
        subprocess.run(["mount", "-o", "remount,bind,ro", results], check=True)
        running.wait()
        _end_of_session(running.pid)
    finally:
        subprocess.run(["umount", "--lazy", results], check=True)


def _disk_full(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """The results become a file system of a few hundred kB, which fills; their like is there before. Needs root."""
    time.sleep(moment)
    results = folder / "results"
    aside = folder / "aside"
    results.mkdir(exist_ok=True)
    shutil.copytree(results, aside, ignore_dangling_symlinks=True)
    size = sum(path.stat().st_size for path in aside.rglob("*") if path.is_file()) + rng.randrange(300_000)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "none", results], check=True)
    try:
        with suppress(shutil.Error):
            shutil.copytree(aside, results, dirs_exist_ok=True)
        running.wait()
        _end_of_session(running.pid)
    finally:
        subprocess.run(["umount", "--lazy", results], check=True)
        shutil.rmtree(aside)


def _moved(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """All is killed; the folder is copied without Snakemake's records, as to another computer, and takes its place."""
    time.sleep(moment)
    if running.poll() is None:
        os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    copy = folder.with_name("copy")
    shutil.copytree(folder, copy, ignore=shutil.ignore_patterns(".snakemake"))
    shutil.rmtree(folder)
    copy.rename(folder)


FAULTS: dict[str, Callable[..., None]] = {
    "kill-snakemake": _kill_snakemake,
    "kill-stage": _kill_stage,
    "kill-all": _signal_all(signal.SIGKILL),
    "ctrl-c": _signal_all(signal.SIGINT),
    "terminate": _terminate_snakemake,
    "second-call": _second_call,
    "config-edited": _tweak_and_back,
    "files-too-large": _full_disk,
    "folder-in-the-way": _read_only_results,
    "read-only": _read_only,
    "disk-full": _disk_full,
    "clock-jumps": _clock_jumps,
    "recording-replaced": _recording_replaced,
    "killed-and-copied": _moved,
}

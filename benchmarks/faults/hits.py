"""What hits a Snakemake at work: each takes its process, its folder, a moment in s and a generator of random numbers.

It may answer what it met.
"""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import yaml

from benchmarks.faults.processes import HOUSE, at_work, command, end_of_session, servers, session


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
        others = [pid for pid in session(running.pid) if pid != running.pid]
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


def _until(running: subprocess.Popen[str], found: Callable[[], list[int]]) -> list[int]:
    """What is found first, while Snakemake runs; empty where it ends before."""
    while running.poll() is None:
        if pids := found():
            return pids
        time.sleep(0.005)
    return []


def _kill_worker(number: int) -> Callable[..., str]:
    def fault(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> str:
        """A worker at its job, among those that other jobs are done by."""
        time.sleep(moment)
        for pid in _until(running, lambda: at_work(running.pid))[:1]:
            with suppress(ProcessLookupError):
                os.kill(pid, number)
                return "a worker at work"
        return "no worker was at work"

    return fault


def _kill_every_worker(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> str:
    """All workers, at work or not, again and again for a third of the run, from when there are some."""
    time.sleep(moment / 2)
    _until(running, lambda: list(servers(running.pid)[1]))
    end, killed = time.monotonic() + moment / 3, 0
    while time.monotonic() < end and running.poll() is None:
        for pid in servers(running.pid)[1]:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
                killed += 1
        time.sleep(rng.uniform(0.05, 0.8))
    return f"{killed} workers"


def _kill_server(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> str:
    """The server, while a worker of it is at its job."""
    time.sleep(moment)
    _until(running, lambda: at_work(running.pid))
    for pid in servers(running.pid)[0]:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
            return "the server, a worker at work"
    return "the server was not there"


def _second_call(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """A second call while the first one runs."""
    time.sleep(moment)
    subprocess.run(command(folder), env=os.environ | {"PYTHONPATH": str(HOUSE)}, capture_output=True, check=False)


def _tweak_and_back(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """The config is edited while it is worked on; then the user thinks better of it."""
    path = folder / "config.yaml"
    before = path.read_text()
    config = yaml.safe_load(before)
    config.setdefault("detect", {})["threshold"] = 90
    time.sleep(moment)
    path.write_text(yaml.safe_dump(config))
    subprocess.run(
        [*command(folder), "-n"], env=os.environ | {"PYTHONPATH": str(HOUSE)}, capture_output=True, check=False
    )
    running.wait()
    path.write_text(before)


def _full_disk(running: subprocess.Popen[str], folder: Path, moment: float, rng: random.Random) -> None:
    """From a moment on no process may write a file of more than a few thousand bytes."""
    time.sleep(moment)
    for pid in session(running.pid):
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
        end_of_session(running.pid)
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
        end_of_session(running.pid)
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


FAULTS: dict[str, Callable[..., str | None]] = {
    "kill-snakemake": _kill_snakemake,
    "kill-stage": _kill_stage,
    "kill-worker": _kill_worker(signal.SIGKILL),
    "terminate-worker": _kill_worker(signal.SIGTERM),
    "kill-every-worker": _kill_every_worker,
    "kill-server": _kill_server,
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

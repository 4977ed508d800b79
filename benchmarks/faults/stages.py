"""The job of each rule killed, stopped, hindered and called in a forked process, without Snakemake: hundreds of times.

What a fault leaves must be whole or absent, an account must not stand without its results, the user must have read one
line at most, and the same call again must make the bytes of an undisturbed run and leave no unfinished file.
"""

from __future__ import annotations

import errno
import importlib
import io
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.season import Planned
from vidtrack.workflow import entry
from vidtrack.workflow.job import module_of
from vidtrack.workflow.job_server import LIBRARIES

WITHOUT_RIGHTS = 65534
SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Ended(NamedTuple):
    """How a job ended: its code (negative: the signal), and the lines that the user read."""

    code: int
    lines: list[str]


class Fault(NamedTuple):
    """One way to disturb a job.

    inside   what is done in the job's process before it begins
    outside  what is done to the process from outside
    code     the codes with which the job may end
    lines    how many lines the user may read
    mend     what is done before the second call
    """

    inside: Callable[[Any], None] | None = None
    outside: Callable[[int, float, random.Random], None] | None = None
    code: tuple[int, ...] = (0,)
    lines: int = 1
    prepare: Callable[[Path, Planned, random.Random], Callable[[], None]] | None = None


def _kill(process: int, length: float, rng: random.Random) -> None:
    _signal(process, length, rng, signal.SIGKILL)


def _terminate(process: int, length: float, rng: random.Random) -> None:
    _signal(process, length, rng, signal.SIGTERM)


def _interrupt(process: int, length: float, rng: random.Random) -> None:
    _signal(process, length, rng, signal.SIGINT)


def _signal(process: int, length: float, rng: random.Random, number: int) -> None:
    time.sleep(rng.uniform(0.0, length))
    with suppress(ProcessLookupError):
        os.kill(process, number)


OPERATIONS = ("replace", "fsync", "unlink", "rename", "chmod", "makedirs")


def _at_an_operation(act: Callable[[], None], sticky: bool) -> Callable[[random.Random], None]:
    """At the k-th thing that the job does to the file system, before or after it; sticky: at all that follow too."""

    def inside(rng: random.Random) -> None:
        left = [rng.randrange(1, 40)]
        after = rng.random() < 0.5

        def wrapped(does: Callable[..., Any]) -> Callable[..., Any]:
            def do(*given: Any, **more: Any) -> Any:
                left[0] -= 1
                now = left[0] == 0 or (sticky and left[0] < 0)
                if now and not (after and not sticky):
                    act()
                answer = does(*given, **more)
                if now:
                    act()
                return answer

            return do

        for name in OPERATIONS:
            setattr(os, name, wrapped(getattr(os, name)))
        tempfile.mkstemp = wrapped(tempfile.mkstemp)

    return inside


def _die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _no_space() -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _small_files(rng: random.Random) -> None:
    """No file may become larger than so many bytes, as at the end of a disk."""
    most = rng.choice([0, 1, 500, 3000, 20_000])
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


def _without_rights(rng: random.Random) -> None:
    os.setgroups([])
    os.setgid(WITHOUT_RIGHTS)
    os.setuid(WITHOUT_RIGHTS)


def _unreadable(folder: Path, job: Planned, rng: random.Random) -> Callable[[], None]:
    """One of the job's inputs may not be read."""
    inputs = [folder / name for name in job.inputs if (folder / name).is_file()]
    if not inputs:
        return lambda: None
    path = rng.choice(inputs)
    path.chmod(0)
    return lambda: path.chmod(0o666)


def _closed_folder(folder: Path, job: Planned, rng: random.Random) -> Callable[[], None]:
    """The folder of one of the outputs may not be written: by one who is not root."""
    path = (folder / rng.choice([*job.outputs, job.account])).parent
    path.mkdir(parents=True, exist_ok=True)
    path.chmod(0o555)
    return lambda: path.chmod(0o777)


def _in_the_way(folder: Path, job: Planned, rng: random.Random) -> Callable[[], None]:
    """A folder stands where an output would be."""
    path = folder / rng.choice(job.outputs)
    path.mkdir(parents=True)
    return path.rmdir


def _log_in_the_way(folder: Path, job: Planned, rng: random.Random) -> Callable[[], None]:
    """An input is missing, and the log cannot be written: the line that says so is read all the same."""
    inputs = [folder / name for name in job.inputs if (folder / name).is_file()]
    log = folder / job.arguments[job.arguments.index("--log") + 1]
    log.unlink(missing_ok=True)
    log.mkdir(parents=True)
    if not inputs:
        return log.rmdir
    path = rng.choice(inputs)
    aside = path.with_name(f"{path.name}.aside")
    path.rename(aside)

    def back() -> None:
        aside.rename(path)
        log.rmdir()

    return back


def _clock_jumps(folder: Path, job: Planned, rng: random.Random) -> Callable[[], None]:
    """Each input, and the folder of each output, gets a date of its own, up to a year off; and again before the second
    call.
    """
    paths = [path for name in job.inputs if (path := folder / name).exists()]
    paths += {path.parent for name in job.outputs if (path := folder / name).parent.exists()}

    def jump() -> None:
        for path in paths:
            at = time.time() + rng.uniform(-1, 1) * 365 * 86_400
            os.utime(path, (at, at))

    jump()
    return jump


KILLED = (0, -signal.SIGKILL)
FAULTS: dict[str, Fault] = {
    "kill at a moment": Fault(outside=_kill, code=KILLED, lines=0),
    "kill at a file operation": Fault(inside=_at_an_operation(_die, False), code=KILLED, lines=0),
    "SIGTERM": Fault(outside=_terminate, code=(0, -signal.SIGTERM), lines=0),
    "Ctrl-C": Fault(outside=_interrupt, code=(0, 130, -signal.SIGINT), lines=0),
    "no space from a file operation on": Fault(inside=_at_an_operation(_no_space, True), code=(0, 1)),
    "no space for a large file": Fault(inside=_small_files, code=(0, 1)),
    "folder may not be written": Fault(inside=_without_rights, prepare=_closed_folder, code=(0, 1)),
    "input may not be read": Fault(inside=_without_rights, prepare=_unreadable, code=(0, 1)),
    "folder in the way of an output": Fault(prepare=_in_the_way, code=(1,)),
    "clock jumps, kill at a moment": Fault(outside=_kill, prepare=_clock_jumps, code=KILLED, lines=0),
    "input gone, log cannot be written": Fault(prepare=_log_in_the_way, code=(0, 1), lines=2),
}


def load_libraries() -> None:
    """What jobs import, once, so that a fork costs nothing of it."""
    for name in LIBRARIES:
        with suppress(ImportError):
            importlib.import_module(name)


def called(
    folder: Path, job: Planned, fault: Fault | None = None, rng: random.Random | None = None, length: float = 0.0
) -> Ended:
    """Run a job in a forked process to its end."""
    heard, said = os.pipe()  # no file: some faults forbid files to grow
    # until the child can answer a signal: it would go on with its parent's work
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    process = os.fork()
    if not process:
        code = 1
        try:
            for channel in (1, 2):
                os.dup2(said, channel)
            sys.stdout, sys.stderr = (os.fdopen(n, "w", buffering=1) for n in (1, 2))
            os.chdir(folder)
            sys.stdin = io.StringIO("\n".join(job.order))
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if fault and fault.inside and rng:
                fault.inside(rng)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
            code = entry.main(job.arguments)
            folder.with_name(f"{folder.name}-modules").write_text("\n".join(sys.modules))
        except KeyboardInterrupt:  # before the job began
            code = 130
        except SystemExit as error:
            code = int(error.code or 0)
        finally:
            with suppress(BaseException):
                sys.stderr.flush()
            os._exit(code)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    if fault and fault.outside and rng:
        fault.outside(process, length, rng)
    os.close(said)
    with open(heard, encoding="utf-8", errors="replace") as file:
        lines = [line for line in file.read().splitlines() if line]
    _, status = os.waitpid(process, 0)
    return Ended(os.waitstatus_to_exitcode(status), lines)


class Count(NamedTuple):
    """times: trials; hit: those in which the job did not end well; lost: what was; most: lines that the user read."""

    times: int
    hit: int
    lost: list[str]
    most: int


def disturbed(folder: Path, job: Planned, names: list[str], times: int, rng: random.Random) -> dict[str, Count]:
    """Each fault so many times upon one job, of which all inputs are there."""
    importlib.import_module(module_of(job.rule))
    if (ended := called(folder, job)).code:
        raise SystemExit(f"{job.account}: fails undisturbed: {ended.lines}")
    usual = set(ended.lines)  # warnings of an undisturbed job
    whole = {name: (folder / name).read_bytes() for name in (*job.outputs, job.account)}
    for name in folder.with_name(f"{folder.name}-modules").read_text().split("\n"):
        with suppress(Exception):  # who has no rights may not read Python's own files everywhere
            importlib.import_module(name)
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o777 if path.is_dir() else 0o666)
    begun = time.monotonic()
    called(folder, job)
    length = time.monotonic() - begun
    found = {}
    for name in names:
        fault, hit, lost, most = FAULTS[name], 0, [], 0
        for _ in range(times):
            for path in whole:
                (folder / path).unlink(missing_ok=True)
            mend = fault.prepare(folder, job, rng) if fault.prepare else None
            ended = called(folder, job, fault, rng, length)
            if mend:
                mend()
            ended = ended._replace(lines=[line for line in ended.lines if line not in usual])
            hit += ended.code != 0
            most = max(most, len(ended.lines))
            lost += _problems(folder, job, fault, ended, whole)
        found[name] = Count(times, hit, lost, most)
    return found


def _problems(folder: Path, job: Planned, fault: Fault, ended: Ended, whole: dict[str, bytes]) -> list[str]:
    """What a fault spoilt, and what it leaves after a second call."""
    problems = []
    if ended.code not in fault.code:
        problems.append(f"ended with {ended.code}: {ended.lines[:3]}")
    if len(ended.lines) > fault.lines or (ended.code == 1 and not ended.lines):
        problems.append(f"{len(ended.lines)} lines: {ended.lines[:3]}")
    if any(not line.startswith("vidtrack: ") for line in ended.lines):
        problems.append(f"lines of other words: {ended.lines[:3]}")
    for name, data in whole.items():
        if (folder / name).exists() and (folder / name).read_bytes() != data:
            problems.append(f"{name} is not whole")
    if (folder / job.account).exists() and not all((folder / name).exists() for name in whole):
        problems.append("an account without its results")
    if (again := called(folder, job)).code:
        problems.append(f"the second call ended with {again.code}: {again.lines[:2]}")
    problems += [f"{name}: other bytes" for name, data in whole.items() if not _is(folder / name, data)]
    for place in {(folder / name).parent for name in whole}:
        problems += [f"left {path.name}" for path in place.glob(".*.partial")]
    return problems


def _is(path: Path, data: bytes) -> bool:
    return path.is_file() and path.read_bytes() == data

"""Jobs that Snakemake asks the server for by itself: neither a shell nor a Python is started for each.

Snakemake starts a rule's shell command by `subprocess.Popen`. The one here reads it first. Where it is just one
job, as our rules write it, the server (see job_server.py) gets the words that the shell would have made of it.
Whatever else it is goes to the shell: a command that is too long for a command line, and every job once the server
is gone.

Where no recording is to be decoded, Snakemake counts a few cores more than there are (see `with_places`): the jobs
that it starts beyond those wait here for one that ends, and begin at once. Else a core would have nothing to do
until Snakemake has noted what the last job made and has chosen another one.
"""

from __future__ import annotations

import re
import shlex
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple

from vidtrack.workflow.small_jobs import LARGE, SERVER, answered, ask, exit_code

_WORD = r"""(?:[\w@%+=:,./-]|'[^']*'|"'")+"""
"""A word as `shlex.quote` writes it: nothing in it means anything to a shell."""

_COMMAND = re.compile(
    rf"set -euo pipefail; +printf '%s\\n'(?P<order>(?: +{_WORD}){{3}}) +\| python -m vidtrack(?P<job>(?: +{_WORD})+) *",
    re.ASCII,
)


class Command(NamedTuple):
    """What a rule's shell command asks for.

    order       what it writes to the job's standard input
    arguments   of the job, the rule first
    """

    order: str
    arguments: list[str]


def command_of(text: str) -> Command | None:
    """What a shell command asks for, as Snakemake calls it; None where it is not just one of our jobs."""
    if not (found := _COMMAND.fullmatch(text)):
        return None
    order = "".join(f"{line}\n" for line in shlex.split(found["order"]))
    return Command(order, shlex.split(found["job"]))


WAITING = 4
"""Jobs that wait beside those at work. Snakemake has five threads more than there are cores; each waits for one job."""


class Places:
    """How many small jobs may be at work at once; `None`: as many as Snakemake starts."""

    def __init__(self, cores: int | None = None) -> None:
        self._free = threading.BoundedSemaphore(cores) if cores else None

    def take(self) -> None:
        """Wait for a free place."""
        if self._free is not None:
            self._free.acquire()

    def leave(self) -> None:
        if self._free is not None:
            self._free.release()


class Number(int):
    """Of the process of a job, with what it used once it has ended: ms of processor time, KB of memory at most."""

    used: tuple[int, ...] = ()


class ServedJob:
    """A job of the server, as Snakemake knows a process."""

    def __init__(self, server: socket.socket, pid: int, again: Mapping[str, Any], places: Places) -> None:
        self.pid, self._server, self._again, self._places = Number(pid), server, again, places

    def wait(self) -> int:
        """The exit code; where the server was killed, and the job with it, that of one more try by the shell."""
        try:
            with self._server:
                ended = answered(self._server, 3)
            if ended is None:
                return subprocess.Popen(**self._again).wait()
        finally:
            self._places.leave()
        code, *used = ended
        self.pid.used = tuple(used)
        return exit_code(code)

    def kill(self) -> None:
        """End the job: the server does, when its caller is gone."""
        self._server.shutdown(socket.SHUT_RDWR)

    terminate = kill


class ShellJob(subprocess.Popen[Any]):
    """A small job that the shell does."""

    places = Places()

    def wait(self, timeout: float | None = None) -> int:
        """The exit code."""
        code = super().wait(timeout)
        places, self.places = self.places, Places()
        places.leave()
        return code


def start(
    args: str, *, env: Mapping[str, str], places: Places = ShellJob.places, **more: Any
) -> ServedJob | subprocess.Popen[Any]:
    """In place of `subprocess.Popen` of a shell command: the job, asked of the server where it does such ones.

    places   a small job begins when there is a free one
    """
    again = {"args": args, "env": env, **more}
    command = command_of(args)
    if command is None:
        return subprocess.Popen(**again)
    places.take()
    server = socket.socket(socket.AF_UNIX)
    try:
        server.connect(env[SERVER].split("\n")[0])
        ask(server, command.arguments, command.order, env)
        if (pid := answered(server)) is not None:
            return ServedJob(server, pid[0], again, places)
    except (OSError, KeyError):
        pass
    server.close()
    try:
        job = ShellJob(**again)
    except BaseException:
        places.leave()
        raise
    job.places = places
    return job


def measured_by(benchmarked: Callable[..., Any]) -> Callable[..., Any]:
    """Snakemake's measuring of a process, but for jobs of the server, which says what they used: nothing is sampled."""

    @contextmanager
    def measured(pid: int | None = None, record: Any = None, *more: Any) -> Iterator[Any]:
        if not isinstance(pid, Number):
            with benchmarked(pid, record, *more) as found:
                yield found
            return
        begun = time.time()
        try:
            yield record
        finally:
            record.running_time = max(time.time() - begun, 1e-9)
            if pid.used:
                record.cpu_time, record.max_rss = pid.used[0] / 1000, pid.used[1] / 1024
                record.cpu_usage, record.data_collected = 100 * record.cpu_time, True
            record.process_gone = True

    return measured


def with_places(scheduler: Any, cores: int) -> Places:
    """Let Snakemake start a few more jobs than there are cores, where all are small; the places that they wait for."""
    if any(job.rule.name in LARGE for job in scheduler.workflow.dag.needrun_jobs()):
        return Places()
    for resources in (scheduler.resources, scheduler.global_resources):
        resources["_cores"] += WAITING
    return Places(cores)


def for_shell_commands(shell: Any, benchmark: Any, places: Places) -> None:
    """Let the modules of Snakemake that start shell commands, and measure them, do so by `start` and `measured_by`."""
    shell.sp = SimpleNamespace(**{**vars(shell.sp), "Popen": partial(start, places=places)})
    benchmark.benchmarked = measured_by(benchmark.benchmarked)

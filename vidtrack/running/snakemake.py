"""Snakemake as a child: its text goes to a log, lines in vidtrack's own words are kept, Ctrl-C is passed on."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import IO, NamedTuple

from rich.console import Console

from vidtrack.errors import VidtrackError
from vidtrack.progress import ANNOUNCED
from vidtrack.running.display import Display, Steps
from vidtrack.workflow.shipped import workflow_file

LOG = os.path.join(".snakemake", "vidtrack.log")
"""Where Snakemake's own text goes, in the folder that holds config.yaml."""

ONLY = "VIDTRACK_RUN"
"""The variable of the environment by which one run alone is wanted."""

OWN = "vidtrack: "
"""How the lines begin that are meant for people."""


class Ended(NamedTuple):
    """How a call of Snakemake ended.

    code   its exit code; stopped: whether someone stopped it
    said   lines in vidtrack's words, each once, without `vidtrack: `
    last   the last lines of its other text
    """

    code: int
    stopped: bool
    said: list[str]
    last: list[str]
    steps: Steps


def arguments_for(folder: str, cores: str, more: Sequence[str] = ()) -> list[str]:
    """The command line of Snakemake for an experiment, with the profile of the workflow."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", workflow_file("Snakefile")]
    command += ["--profile", workflow_file("profiles", "default"), "--directory", os.path.abspath(folder)]
    return [*command, "--cores", cores, *more]


def run_snakemake(
    folder: str, cores: str, console: Console, *, only: str | None = None, more: Sequence[str] = ()
) -> Ended:
    """Process an experiment and show how far it is.

    only   the name of a run: the calibration that it needs, and it
    """
    log = os.path.join(folder, LOG)
    os.makedirs(os.path.dirname(log), exist_ok=True)
    command = arguments_for(folder, cores, more)
    with tempfile.TemporaryDirectory(prefix="vidtrack-") as jobs, _opened(log) as text:
        environment = {**os.environ, ANNOUNCED: jobs, "PYTHONUNBUFFERED": "1"}
        environment.pop(ONLY, None)
        if only is not None:
            environment[ONLY] = only
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env=environment,
            start_new_session=True,
        )
        said: list[str] = []
        last: list[str] = []
        stops = _Stops(child)
        with stops, Display(console, jobs, lambda: stops.asked > 0) as display:
            for line in _lines(child, display):
                text.write(line)
                line = line.rstrip()
                display.heard(line)
                if line.startswith(OWN):
                    said.append(line.removeprefix(OWN))
                elif line:
                    last = [*last[-14:], line]
            steps = display.steps
        return Ended(child.wait(), stops.asked > 0, list(dict.fromkeys(said)), last, steps)


def _opened(log: str) -> IO[str]:
    try:
        return open(log, "w", encoding="utf-8")
    except OSError as error:
        raise VidtrackError(f"{log}: cannot be written ({error.strerror}). Correct its permissions.") from None


def _lines(child: subprocess.Popen[str], display: Display) -> Iterator[str]:
    """Lines of the child's text as they come; the display is drawn again while none comes."""
    lines: queue.Queue[str | None] = queue.Queue()

    def read() -> None:
        assert child.stdout is not None
        for line in child.stdout:
            lines.put(line)
        lines.put(None)

    threading.Thread(target=read, daemon=True).start()
    while True:
        display.refresh()
        try:
            line = lines.get(timeout=0.25)
        except queue.Empty:
            continue
        if line is None:
            return
        yield line


class _Stops:
    """While it stands, Ctrl-C and SIGTERM go to Snakemake and its jobs: the first asks them to end, the third kills."""

    def __init__(self, child: subprocess.Popen[str]) -> None:
        self._child, self.asked = child, 0
        self._before: dict[int, object] = {}

    def __enter__(self) -> _Stops:
        if threading.current_thread() is threading.main_thread():
            self._before = {s: signal.signal(s, self._pass_on) for s in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]

    def _pass_on(self, *_: object) -> None:
        self.asked += 1
        wanted = {1: signal.SIGINT, 2: signal.SIGTERM}.get(self.asked, signal.SIGKILL)
        with suppress(ProcessLookupError):
            os.killpg(self._child.pid, wanted)

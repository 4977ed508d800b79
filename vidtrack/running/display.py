"""One display over all jobs: what runs, how far it is, how fast, and how long it will take."""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

_TOTAL = re.compile(r"^total\s+(\d+)\s*$")
_STEPS = re.compile(r"^(\d+) of (\d+) steps")


class Steps(NamedTuple):
    """Jobs done, of how many; None while that is not known."""

    done: int = 0
    total: int | None = None

    def after(self, line: str) -> Steps:
        """What is known after one more line of Snakemake's text."""
        # the last step is rule `all`, which does nothing
        if found := _STEPS.match(line):
            return Steps(min(int(found[1]), int(found[2]) - 1), int(found[2]) - 1)
        if found := _TOTAL.match(line):
            return Steps(self.done, int(found[1]) - 1)
        return self


def jobs_at_work(folder: str) -> list[dict[str, Any]]:
    """What the processes that announce themselves in a folder are at; those that were killed are left out."""
    found = []
    for name in sorted(os.listdir(folder)):
        if name.endswith(".json"):
            with suppress(OSError, ValueError):
                os.kill(int(name[:-5]), 0)
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    found.append(json.load(file))
    return found


def time_left(job: Mapping[str, Any]) -> float | None:
    """s; None where it cannot be known."""
    if not job.get("total") or not job["done"] or not job["elapsed"]:
        return None
    return float(max(job["total"] - job["done"], 0) * job["elapsed"] / job["done"])


class Display:
    """The display of a run of the workflow: redrawn in place on a terminal, a line for each job done elsewhere."""

    def __init__(self, console: Console, jobs: str, stopping: Callable[[], bool] = lambda: False) -> None:
        self._console, self._jobs, self._stopping = console, jobs, stopping
        self._steps = Steps()
        self._began = time.monotonic()
        self._seen: dict[str, float] = {}
        in_place = console.is_terminal and not console.is_dumb_terminal
        self._live = Live(console=console, auto_refresh=False, transient=True) if in_place else None

    def __enter__(self) -> Display:
        if self._live:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._live.stop()

    @property
    def steps(self) -> Steps:
        """How many jobs are done."""
        return self._steps

    def heard(self, line: str) -> None:
        """Take in one line of Snakemake's text."""
        before, self._steps = self._steps, self._steps.after(line)
        if not self._live and self._steps.done > before.done:
            self._console.print(f"vidtrack: {self._steps.done} of {self._steps.total} jobs done", highlight=False)

    def refresh(self) -> None:
        """Draw again."""
        if self._live:
            self._live.update(self._drawn(), refresh=True)

    def _drawn(self) -> Group:
        done, total = self._steps
        at_work = jobs_at_work(self._jobs)
        head = Table.grid(padding=(0, 2))
        stopping = "stopping: " if self._stopping() else ""
        what = stopping + (f"{done} of {total} jobs done" if total else "planning: what is there, what has changed")
        head.add_row(
            what, ProgressBar(total=total or 1, completed=done, width=24, pulse=not total), self._since_start()
        )
        rows = [(job["job"], *self._columns(job)) for job in at_work]
        if self._stopping():
            rows = rows or [("the jobs under way are being ended; Ctrl-C again does not wait for them", "", "", "")]
        elif total and not at_work:
            rows = [("the next jobs are being started" if done < total else "ending", "", "", "")]
        self._seen = {job["job"]: self._seen[job["job"]] for job in at_work}
        return Group(head, *(Text(line, no_wrap=True) for line in in_columns(rows, self._console.width)))

    def _columns(self, job: Mapping[str, Any]) -> tuple[str, str, str]:
        """How far a job is, how fast it goes, and how long it will take; while it counts nothing, how long it took."""
        begun = self._seen.setdefault(job["job"], time.monotonic())
        if not job["done"]:
            return job.get("phase", ""), "", f"for {clock(time.monotonic() - begun)}"
        of = f" of {job['total']}" if job.get("total") else ""
        rate = f"{job['done'] / job['elapsed']:.0f}/s" if job["elapsed"] else ""
        left = time_left(job)
        return f"{job['done']}{of} {job['unit']}", rate, f"{clock(left)} left" if left is not None else ""

    def _since_start(self) -> str:
        return clock(time.monotonic() - self._began)


def in_columns(rows: Sequence[tuple[str, ...]], width: int) -> list[str]:
    """Rows as lines of at most `width` characters; the first column is shortened in its middle where it must be."""
    sizes = [max((len(cell) for cell in column), default=0) for column in zip(*rows, strict=True)]
    room = max(width - sum(size + 2 for size in sizes[1:]) - 3, 12)
    lines = []
    for name, *cells in rows:
        half = room // 2
        name = name if len(name) <= room else f"{name[: room - half - 1]}…{name[len(name) - half :]}"
        rest = "".join(f"  {cell:>{size}}" for cell, size in zip(cells, sizes[1:], strict=True))
        lines.append(f"  {name:<{min(sizes[0], room)}}{rest}"[:width])
    return lines


def clock(seconds: float) -> str:
    """Minutes and seconds, and hours where there are any."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}" if minutes >= 60 else f"{minutes}:{rest:02d}"

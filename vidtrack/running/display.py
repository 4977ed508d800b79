"""One display over all jobs: what runs, how far it is, how fast, and how long it will take."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
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

    def __init__(self, console: Console, jobs: str) -> None:
        self._console, self._jobs = console, jobs
        self._steps = Steps()
        self._live = Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None

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
        table = Table.grid(padding=(0, 2))
        head = Text(f"{done} of {total} jobs done" if total else "planning")
        table.add_row(head, ProgressBar(total=total or 1, completed=done, width=24), "", "")
        for job in jobs_at_work(self._jobs):
            left = time_left(job)
            rate = f"{job['done'] / job['elapsed']:.0f} {job['unit']}/s" if job["elapsed"] and job["done"] else ""
            of = f" of {job['total']}" if job.get("total") else ""
            table.add_row(
                f"  {job['job']}",
                f"{job['done']}{of} {job['unit']}" if job["done"] else "",
                rate,
                f"{int(left) // 60}:{int(left) % 60:02d} left" if left is not None else "",
            )
        return Group(table)

"""Progress of long work: frames done, rate and time left on a terminal; nothing at all in a log.

Where the environment names a folder (`ANNOUNCED`), each process keeps a small file there that says what it is at, for a
display over all of them.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from types import TracebackType
from typing import TextIO, TypeVar

T = TypeVar("T")

ANNOUNCED = "VIDTRACK_PROGRESS"
"""The variable of the environment that names the folder."""


def announce(
    job: str, done: int = 0, total: int | None = None, unit: str = "", elapsed: float = 0.0, phase: str = ""
) -> None:
    """Say what this process is at, where someone asked for it; a full disk is no reason to stop the work.

    phase   what it does while it counts nothing
    """
    folder = os.environ.get(ANNOUNCED)
    if folder:
        path = os.path.join(folder, f"{os.getpid()}.json")
        with suppress(OSError):
            with open(path + "~", "w", encoding="utf-8") as file:
                record = {"job": job, "done": done, "total": total, "unit": unit, "elapsed": elapsed}
                json.dump({**record, "phase": phase} if phase else record, file)
            os.replace(path + "~", path)


def announce_end() -> None:
    """Say that this process has ended its job."""
    if folder := os.environ.get(ANNOUNCED):
        with suppress(OSError):
            os.unlink(os.path.join(folder, f"{os.getpid()}.json"))


class Progress:
    """A line that is rewritten in place, at most four times a second, while work goes on.

    total   how many units are expected; None where that is not known (then no time left is shown)
    The line is erased at the end, so that a terminal keeps only what matters.
    """

    def __init__(
        self, label: str, total: int | None = None, unit: str = "frames", stream: TextIO | None = None
    ) -> None:
        self.label, self.total, self.unit = label, total, unit
        self.stream = sys.stderr if stream is None else stream
        self.live = self.stream.isatty()
        self.announced = bool(os.environ.get(ANNOUNCED))
        self.done = 0
        self._began = self._shown = time.monotonic()

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        announce(self.label, phase=f"{self.done} {self.unit} read, computing")
        if self.live:
            self.stream.write("\r\x1b[K")
            self.stream.flush()

    def advance(self, n: int = 1) -> None:
        """Count n more units done."""
        self.done += n
        if not (self.live or self.announced):
            return
        now = time.monotonic()
        if now - self._shown > 0.25:
            self._shown = now
            announce(self.label, self.done, self.total, self.unit, now - self._began)
            if self.live:
                self.stream.write("\r\x1b[K" + self.line(now - self._began))
                self.stream.flush()

    def over(self, items: Iterable[T]) -> Iterator[T]:
        """The items unchanged, each counted once it has been used."""
        for item in items:
            yield item
            self.advance()

    def line(self, elapsed: float) -> str:
        """What the terminal shows after `elapsed` seconds."""
        rate = self.done / elapsed if elapsed > 0 else 0.0
        text = f"{self.label}: {self.done}"
        if self.total:
            text += f" of {self.total}"
        text += f" {self.unit}, {rate:.0f}/s"
        if self.total and rate > 0 and self.total > self.done:
            left = round((self.total - self.done) / rate)
            text += f", {left // 60}:{left % 60:02d} left"
        return text

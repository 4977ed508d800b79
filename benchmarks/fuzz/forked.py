"""Mutated files read in a forked process, which may use so much memory and so long for a file: what hangs or dies is
found by the number of its seed, and the rest goes on.
"""

from __future__ import annotations

import mmap
import os
import resource
import signal
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from benchmarks.fuzz.reader import Reader, changed, outcome

MEMORY = 2_000_000_000
"""Bytes that a reader may use beyond what the loaded libraries hold."""

SLOW, LOST = 20.0, 300.0
"""s of processor time, and of the clock, for one file of a few pictures or rows: more is a reader that hangs."""

READ, REFUSED, WRONG = 1, 2, 3


class Found(NamedTuple):
    """wrong: seed, and what it was; largest: MB that a process held at most; slowest: s of processor time of a file."""

    read: int
    refused: int
    wrong: list[tuple[int, str]]
    largest: float
    slowest: float


def tried_forked(name: str, reader: Reader, seeds: range) -> Found:
    """What became of the file under each seed."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as place:
        folder = Path(place)
        path = reader.make(folder)
        data = path.read_bytes()
        target = folder / reader.file if reader.file else path
        reader.read(str(target))  # it is healthy
        fates = mmap.mmap(-1, len(seeds) + 1)
        now = mmap.mmap(-1, 16)
        notes = folder / "notes"
        wrong: list[tuple[int, str]] = []
        begin, largest, slowest = 0, 0.0, 0.0
        while begin < len(seeds):
            worker = os.fork()
            if not worker:
                _work(name, reader, seeds, begin, (path, target, data), (fates, now, notes))
            ended, usage, slow = _watched(worker, now)
            largest, slowest = max(largest, usage), max(slowest, slow)
            at = int.from_bytes(now[:8], "little")
            if ended:
                fates[at] = WRONG
                wrong.append((seeds[at], ended))
                begin = at + 1
            else:
                begin = len(seeds)
        if notes.exists():
            for line in notes.read_text(errors="replace").split("\0"):
                if line:
                    seed, _, text = line.partition("\n")
                    wrong.append((int(seed), text))
        counts = [fates[: len(seeds)].count(fate) for fate in (READ, REFUSED)]
    return Found(counts[0], counts[1], sorted(wrong), largest, slowest)


def _work(name: str, reader: Reader, seeds: range, begin: int, files: tuple, shared: tuple) -> None:
    """Read the file under the seeds from number `begin` on; never returns."""
    path, target, data = files
    fates, now, notes = shared
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * mmap.PAGESIZE
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, held + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    slowest = 0.0
    for at in range(begin, len(seeds)):
        now[:8] = at.to_bytes(8, "little")
        path.write_bytes(changed(data, name, seeds[at], reader.text))
        before = time.process_time()
        one = outcome(reader.read, target)
        slowest = max(slowest, time.process_time() - before)
        now[8:16] = int(slowest * 1e6).to_bytes(8, "little")
        fates[at] = {"read": READ, "refused": REFUSED}.get(one, WRONG)
        if fates[at] == WRONG:
            with notes.open("a") as file:
                file.write(f"{seeds[at]}\n{one}\0")
    os._exit(0)


def _watched(worker: int, now: mmap.mmap) -> tuple[str, float, float]:
    """How a worker ended that did not do all ("" where it did), MB that it held, and the slowest file."""
    seen, since, used = now[:8], time.monotonic(), _used(worker)
    pause = 0.01
    while True:
        done, status, usage = os.wait4(worker, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
            slow = int.from_bytes(now[8:16], "little") / 1e6
            return (f"died with {code}" if code else ""), usage.ru_maxrss / 1000, slow
        time.sleep(pause)
        pause = min(0.5, pause * 1.5)
        if now[:8] != seen:
            seen, since, used = now[:8], time.monotonic(), _used(worker)
        elif _used(worker) - used > SLOW or time.monotonic() - since > LOST:
            os.kill(worker, signal.SIGKILL)
            _, _, usage = os.wait4(worker, 0)
            return "hangs", usage.ru_maxrss / 1000, SLOW


def _used(process: int) -> float:
    """s of processor time of a process and its threads."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

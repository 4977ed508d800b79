"""What a reader gives, read in one thread while it is used in another."""

from __future__ import annotations

import queue
import sys
import threading
from collections.abc import Generator, Iterable
from typing import TypeVar

T = TypeVar("T")

SWITCH = 5e-5
HANDED = 4
"""Items that are handed from thread to thread at once, at most: each time may wake a thread that sleeps."""


def read_ahead(items: Iterable[T], most: int) -> Generator[T]:
    """The items, read by a thread of their own, about `most` of them ahead.

    Decoders work outside of Python's lock, so that reading and measuring overlap. What the reading raises is raised
    here, after the items that came before it. The thread ends with the items, or when the generator is closed.

    While it runs, Python hands its lock on every SWITCH s: a decoder asks for the lock a few times a frame, and would
    wait for up to 5 ms each time.
    """
    each = max(1, min(HANDED, most // 2))
    passed: queue.Queue[list[T] | BaseException | None] = queue.Queue(max(1, most // each - 1))
    stopped = threading.Event()

    def offer(what: list[T] | BaseException | None) -> bool:
        while not stopped.is_set():
            try:
                passed.put(what, timeout=0.2)
                return True
            except queue.Full:
                continue
        return False

    def read() -> None:
        batch: list[T] = []
        try:
            for item in items:
                batch.append(item)
                if len(batch) == each:
                    if not offer(batch):
                        return
                    batch = []
        except BaseException as error:
            offer(batch)
            offer(error)
            return
        offer(batch)
        offer(None)

    reader = threading.Thread(target=read, name="read ahead", daemon=True)
    usual = sys.getswitchinterval()
    sys.setswitchinterval(min(usual, SWITCH))
    reader.start()
    try:
        while (batch := passed.get()) is not None:
            if isinstance(batch, BaseException):
                raise batch
            yield from batch
    finally:
        stopped.set()
        reader.join()
        sys.setswitchinterval(usual)

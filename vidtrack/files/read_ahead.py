"""Frames decoded in one thread while they are measured in another."""

from __future__ import annotations

import queue
import sys
import threading
from collections.abc import Iterable, Iterator
from typing import TypeVar

T = TypeVar("T")

SWITCH = 2e-4


def batches_ahead(items: Iterable[T], size: int, waiting: int = 2) -> Iterator[list[T]]:
    """The items in lists of `size`, read by a thread of their own, at most `waiting` lists ahead.

    Decoders work outside of Python's lock, so that reading and measuring overlap. What the reading raises is raised
    here, after the items that came before it. The thread ends with the items, or when the generator is closed.

    While it runs, Python hands its lock on every SWITCH s: a decoder asks for the lock a few times a frame, and would
    wait for up to 5 ms each time.
    """
    passed: queue.Queue[list[T] | BaseException | None] = queue.Queue(waiting)
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
                if len(batch) == size:
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
            if batch:
                yield batch
    finally:
        stopped.set()
        reader.join()
        sys.setswitchinterval(usual)

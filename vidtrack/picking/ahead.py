"""Pictures that will be looked at next are decoded while one is looked at; what a person waits for goes first."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from vidtrack.errors import VidtrackError
from vidtrack.video.random_access import Pictures

NEXT = 3
"""Pictures in the direction of travel."""


class Ahead:
    """A thread that measures the picture that was looked at last, so that a click need not wait for it, and then
    decodes its neighbours; it gives up when another one is looked at, and rests while a person waits for an answer.
    """

    def __init__(self) -> None:
        self._wanted: tuple[Pictures, int, int, Callable[[], object]] | None = None
        self._wake = threading.Event()
        self._ended = False
        self._waiting = 0
        self._free = threading.Condition()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ended = True
        self._wake.set()
        with self._free:
            self._free.notify_all()
        self._thread.join(5)

    @contextmanager
    def rests(self) -> Iterator[None]:
        """While an answer is made for which a person waits, nothing is decoded ahead."""
        with self._free:
            self._waiting += 1
        try:
            yield
        finally:
            with self._free:
                self._waiting -= 1
                self._free.notify_all()

    def looked_at(self, pictures: Pictures, number: int, measure: Callable[[], object] = lambda: None) -> None:
        """Measure the picture, and decode what comes next: after it, or before it where the one before this was a
        later one.
        """
        before = self._wanted
        back = before is not None and before[0] is pictures and number < before[1]
        self._wanted = pictures, number, -1 if back else 1, measure
        self._wake.set()

    def _work(self) -> None:
        while True:
            self._wake.wait()
            self._wake.clear()
            if self._ended:
                return
            if self._wanted is None:
                continue
            pictures, number, step, measure = self._wanted
            with suppress(Exception):  # a click on the picture says what is wrong
                measure()
            for n in range(number + step, number + step * (NEXT + 1), step):
                if not 0 <= n < len(pictures) or not self._decoded(pictures, n):
                    break

    def _decoded(self, pictures: Pictures, number: int) -> bool:
        """Whether a picture is there; False where another one is looked at, or it cannot be decoded."""
        rested = True

        def stop() -> bool:
            nonlocal rested
            rested = rested or self._waiting > 0
            return rested or self._wake.is_set()

        while rested and not pictures.has(number):
            with self._free:
                self._free.wait_for(lambda: not self._waiting or self._wake.is_set())
            if self._wake.is_set():
                return False
            rested = False
            with suppress(VidtrackError):
                pictures.picture(number, stop)
        return pictures.has(number)

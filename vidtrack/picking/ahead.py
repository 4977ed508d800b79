"""Pictures that will be looked at next are decoded while one is looked at."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress

from vidtrack.errors import VidtrackError
from vidtrack.video.random_access import Pictures

NEXT = 3
"""Pictures in the direction of travel."""


class Ahead:
    """A thread that decodes the neighbours of the picture that was looked at last, and gives up when another one is.

    Then it measures that picture, so that the first click on it need not wait for it.
    """

    def __init__(self) -> None:
        self._wanted: tuple[Pictures, int, int, Callable[[], object]] | None = None
        self._wake = threading.Event()
        self._ended = False
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._ended = True
        self._wake.set()
        self._thread.join(5)

    def looked_at(self, pictures: Pictures, number: int, measure: Callable[[], object] = lambda: None) -> None:
        """Decode what comes next: after the picture, or before it where the one before this was a later one; measure
        the picture.
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
            for n in range(number + step, number + step * (NEXT + 1), step):
                if self._wake.is_set():
                    break
                if 0 <= n < len(pictures) and not pictures.has(n):
                    try:
                        pictures.picture(n, self._wake.is_set)
                    except VidtrackError:
                        break
            if not self._wake.is_set():
                with suppress(Exception):  # a click on the picture says what is wrong
                    measure()

"""Looks at pictures that do not depend on each other, every other one by a process of its own.

When a recording is read, the core that decoded has nothing to do any more. What decoders log is one list for all that a
process does, so that two threads would not know which of them an error belongs to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Generic, TypeVar

import numpy as np

from vidtrack.video.processes.read_apart import CAN_FORK, Item, ReadApart

Seen = TypeVar("Seen")

FEWEST = 4
"""Looks for which no other process is worth its beginning."""


class LooksBeside(Generic[Seen]):
    """What another process sees at every other one of some pictures, in their order.

    pictures  numbers by which they are called, each once
    look      what is seen at one; it is called in the other process
    path      what is read, for the message when that process is killed
    """

    def __init__(self, pictures: Sequence[int], look: Callable[[int], Seen], path: str) -> None:
        self._theirs = list(pictures[1::2]) if CAN_FORK and len(pictures) > FEWEST else []
        self._seen: dict[int, Seen] = {}
        self._reader: ReadApart | None = None

        def read() -> Iterator[Item]:
            for one in self._theirs:
                yield None, (one, look(one))

        if self._theirs:
            try:
                self._reader = ReadApart(read, (1, 1), np.uint8, 1, path)
                self._items = iter(self._reader)
            except OSError:  # too many processes, or too little memory for another
                self._theirs = []

    def at(self, picture: int) -> Seen | None:
        """What is seen at a picture, as soon as it is; None where the other process does not look at it."""
        if self._reader is None or picture not in self._theirs:
            return None
        while picture not in self._seen:
            one, seen = next(self._items)[1]
            self._seen[one] = seen
        return self._seen[picture]

    def close(self) -> None:
        """End the other process: all that is asked for from now on is None."""
        if self._reader is not None:
            self._reader.close()
            self._reader = None

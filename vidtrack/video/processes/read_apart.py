"""What a reader gives, read by a process of its own; the pictures lie in memory that both processes share.

Threads of Python take turns; processes do not. It costs one copy of each picture. The memory has no name: nothing is
left of it, however the processes end.
"""

from __future__ import annotations

import mmap
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import suppress
from select import select
from typing import Any, NoReturn

import numpy as np
from numpy.typing import DTypeLike

from vidtrack.errors import VidtrackError
from vidtrack.parent import die_with
from vidtrack.timing.frame import Luma

Item = tuple[Luma | None, Any]
"""A picture, and what is to be known of it."""

LEAST, MOST = 3, 255
"""Pictures that the shared memory holds: the least that keep both processes at work; each is named by a byte."""

HANDED = 4
"""Pictures that are handed over at once, at most: each time wakes a process that sleeps."""

CAN_FORK = sys.platform == "linux"
"""Elsewhere the system's own libraries do not bear it."""


class ReadApart:
    """Iterates over the items of `read()`, which a process of its own calls. Raises OSError where none can be had.

    shape, dtype  of the pictures; one that is otherwise is passed on too, only slower
    memory        bytes of pictures that wait or are in use
    path          what is read, for the message when that process is killed
    A picture may be held for as long as it is needed: where many are, copies are given.
    What `read` raises is raised here, after the items that came before it. `close` ends the process.
    """

    def __init__(
        self, read: Callable[[], Iterable[Item]], shape: Sequence[int], dtype: DTypeLike, memory: int, path: str
    ) -> None:
        self._path, self._ring = path, _Ring(shape, dtype, memory)
        ours, theirs = os.pipe(), os.pipe()  # from the process: items; to it: places of pictures that are free again
        parent = os.getpid()
        try:
            with warnings.catch_warnings():  # of threads that a library has started: none is used by the new process
                warnings.simplefilter("ignore", DeprecationWarning)
                self._process = os.fork()
        except OSError:
            for end in (*ours, *theirs):
                os.close(end)
            raise
        if not self._process:
            os.close(ours[0])
            os.close(theirs[1])
            _serve(read, self._ring, ours[1], theirs[0], parent)
        os.close(ours[1])
        os.close(theirs[0])
        self._items, self._ring.back = os.fdopen(ours[0], "rb"), theirs[1]

    def __iter__(self) -> Generator[Item]:
        while True:
            try:
                some = pickle.load(self._items)
            except (EOFError, pickle.UnpicklingError):
                self._was_killed()
            if some is None:
                return
            if isinstance(some, BaseException):
                raise some
            for place, what in some:
                yield self._ring.given(place) if isinstance(place, int) else place, what

    def close(self) -> None:
        """End the process; pictures that were given stay."""
        self._end()

    def _end(self) -> int:
        """How the process ended, as `os.waitstatus_to_exitcode`."""
        if not self._process:
            return 0
        process, self._process = self._process, 0
        os.close(self._ring.back)
        self._ring.back = -1
        self._items.close()
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
        return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])

    def _was_killed(self) -> NoReturn:
        """Raise a VidtrackError that says so."""
        how = -self._end()
        name = signal.Signals(how).name if how in signal.valid_signals() else "no signal"
        raise VidtrackError(
            f"{self._path}: the process that decodes it was killed ({name}), as happens where memory runs out. "
            "Run again, with more memory or fewer cores."
        )


class _Ring:
    """Places for pictures in shared memory.

    back       where freed places are written to; -1 once no process reads them
    described  each place, as NumPy asks for it
    """

    def __init__(self, shape: Sequence[int], dtype: DTypeLike, memory: int) -> None:
        self.shape, self.dtype, self.back = tuple(shape), np.dtype(dtype), -1
        size = int(np.prod(self.shape)) * self.dtype.itemsize
        self._each = -(-size // mmap.PAGESIZE) * mmap.PAGESIZE
        self.places = min(max(memory // self._each, LEAST), MOST)
        self._memory = np.frombuffer(mmap.mmap(-1, self.places * self._each), np.uint8)
        first, kind = int(self._memory.ctypes.data), {"version": 3, "shape": self.shape, "typestr": self.dtype.str}
        self.described = [{**kind, "data": (first + place * self._each, True)} for place in range(self.places)]
        self._held = 0

    def at(self, place: int) -> Luma:
        """The picture at a place."""
        return np.ndarray(self.shape, self.dtype, self._memory, place * self._each)

    def given(self, place: int) -> Luma:
        """A picture, read only, whose place is free once no array shows it; a copy where few places are left."""
        self._held += 1
        picture: Luma = np.asarray(_Held(self, place))
        if self._held <= self.places - max(2, self.places // 4):
            return picture
        picture = picture.copy()
        picture.setflags(write=False)
        return picture

    def freed(self, place: int) -> None:
        self._held -= 1
        if self.back >= 0:
            with suppress(OSError):  # its reader was killed
                os.write(self.back, bytes([place]))


class _Held:
    """A picture in use: NumPy keeps it for as long as an array shows any of it."""

    def __init__(self, ring: _Ring, place: int) -> None:
        self._ring, self._place = ring, place
        self.__array_interface__ = ring.described[place]

    def __del__(self) -> None:
        self._ring.freed(self._place)


def _serve(read: Callable[[], Iterable[Item]], ring: _Ring, out: int, back: int, parent: int) -> NoReturn:
    """Be the process that reads."""
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the other process hears it, and ends this one
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        die_with(parent)
        os.set_blocking(back, False)
        with os.fdopen(out, "wb") as file:
            try:
                _pass_on(read(), ring, file, back)
                last: BaseException | None = None
            except BaseException as error:
                last = error
            _send(last, file)
    finally:
        os._exit(0)


def _pass_on(items: Iterable[Item], ring: _Ring, file: Any, back: int) -> None:
    waiting: list[tuple[Any, Any]] = []
    free, each = list(range(ring.places)), max(1, min(HANDED, ring.places // 4))
    try:
        for picture, what in items:
            place: Any = picture
            if picture is not None and picture.shape == ring.shape and picture.dtype == ring.dtype:
                _take_back(free, back)
                while not free:
                    if waiting:
                        _send(waiting, file)
                        waiting = []
                    select([back], [], [])
                    _take_back(free, back)
                place = free.pop()  # the one that was freed last: its memory is still in the processor's cache
                ring.at(place)[...] = picture
            waiting.append((place, what))
            if len(waiting) == each:
                _send(waiting, file)
                waiting = []
    finally:
        _send(waiting, file)


def _take_back(free: list[int], back: int) -> None:
    """Add the places that were freed meanwhile."""
    try:
        freed = os.read(back, MOST)
    except BlockingIOError:
        return
    if not freed:  # the other process is gone
        os._exit(0)
    free.extend(freed)


def _send(what: Any, file: Any) -> None:
    try:
        data = pickle.dumps(what)
    except Exception:  # an error that holds what cannot be sent
        data = pickle.dumps(RuntimeError(f"{type(what).__name__}: {what}"))
    file.write(data)
    file.flush()

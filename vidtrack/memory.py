"""Memory that a process has used and needs no more."""

import ctypes
import gc
from collections.abc import Generator
from contextlib import contextmanager, suppress


@contextmanager
def collector_paused() -> Generator[None]:
    """Python's search for objects that refer to each other in a circle is put off.

    It goes through all that live again and again: where hundreds of thousands do and none is in a circle, for nothing.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def give_back_memory() -> None:
    """Give the system what was freed: C's library keeps it for later where arrays of some MB came and went.

    Where the library is not that of GNU, nothing is done.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)

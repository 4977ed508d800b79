"""Memory that a process has used and needs no more."""

import ctypes
from contextlib import suppress


def give_back_memory() -> None:
    """Give the system what was freed: C's library keeps it for later where arrays of some MB came and went.

    Where the library is not that of GNU, nothing is done.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)

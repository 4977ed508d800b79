"""Memory that a process has used and needs no more, or need not use."""

from __future__ import annotations

import ctypes
import gc
import mmap
from collections.abc import Collection, Generator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from pandas import DataFrame


_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Of `mallopt`."""
_LARGEST = 32 << 20
"""Bytes up to which a piece of memory may be one that is kept: more GNU's library does not allow."""


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


def keep_freed_memory(most: int) -> None:
    """From now on up to so many bytes of what is freed stay with the process, until `give_back_memory`.

    By itself C's library gives large arrays back and asks for the next ones, whose pages the system fills with zeros:
    where many of some MB come and go, that takes as long as the work on them. Where the library is not that of GNU,
    nothing is done.
    """
    with suppress(AttributeError, OSError, TypeError):
        library = ctypes.CDLL(None)
        library.mallopt(_MMAP_THRESHOLD, _LARGEST)
        library.mallopt(_TRIM_THRESHOLD, most)


class PagesAhead:
    """Pages of memory that the system fills with zeros now, while a process waits for another, for what it does later:
    `del` leaves them with the process.

    each  bytes that will be needed of each sample: where that is less than a page, nothing is done; most: in all
    """

    def __init__(self, each: int, most: int) -> None:
        import numpy as np

        self._each, self._touched = each, 0
        if each >= mmap.PAGESIZE:
            keep_freed_memory(most)
        self._memory = np.empty(most - (1 << 20) if each >= mmap.PAGESIZE else 0, np.uint8)

    def touch(self, samples: int) -> None:
        """So many more samples have passed."""
        to = self._touched + samples * self._each
        self._memory[self._touched : to : mmap.PAGESIZE] = 0
        self._touched = to


def tables_from_c_library() -> None:
    """From now on pyarrow, which holds the words of tables for pandas, takes memory from C's library, as NumPy does.

    Its own allocator takes huge pages, each of which the system fills with zeros: a column of 360,000 words took 8 to
    20 ms instead of 3 to 5. And what is freed can be given back with all else.
    """
    import pyarrow as pa

    pa.set_memory_pool(pa.system_memory_pool())


def columns_of(table: DataFrame, wanted: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """The columns of a table, or those of it that are wanted; each word is held once, however many rows have it.

    By itself pandas makes a new word for each row: 60 bytes for a time code that three targets share.
    """
    import numpy as np
    import pandas as pd

    out = {}
    for name in table:
        if wanted is not None and name not in wanted:
            continue
        column = table[name]
        if isinstance(column.dtype, pd.StringDtype):
            codes, words = pd.factorize(column)
            out[str(name)] = np.append(np.asarray(words, object), np.nan)[codes]  # the last one where there is none
        else:
            out[str(name)] = column.to_numpy()
    return out

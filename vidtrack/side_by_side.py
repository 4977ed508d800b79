"""Parts of a work on large arrays, done in several threads.

NumPy, OpenCV and pyarrow work outside of Python's lock, and the core that decoded has nothing to do any more once the
last picture is measured. Where each part makes large arrays of its own it is slower: the system gives memory to one
thread at a time.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")
Other = TypeVar("Other")

AT_ONCE = 2
"""Threads at most: one for each process that a recording has while it is read."""


def side_by_side(work: Callable[[Part], Result], parts: Sequence[Part]) -> list[Result]:
    """What `work` gives of each part, in their order; what it raises is raised here.

    Parts must not change what others read; `numpy.errstate` of the caller does not hold in `work`.
    """
    threads = min(len(parts), AT_ONCE, os.cpu_count() or 1)
    if threads < 2:
        return [work(part) for part in parts]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, parts))


def both(one: Callable[[], Result], other: Callable[[], Other]) -> tuple[Result, Other]:
    """What two works give that do not wait for each other, as `side_by_side` does parts of one."""
    if (os.cpu_count() or 1) < 2:
        return one(), other()
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(other)
        return one(), waiting.result()

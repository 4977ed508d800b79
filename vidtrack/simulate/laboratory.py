"""An experiment folder, as a laboratory would leave it: clips, survey, picks, recordings, sensor records.

    planned_files(scenario)          what `set_up` will write, without writing it
    set_up(scenario, folder)         write it all

What a laboratory does not have (where the balls truly hung, how the target truly moved) is written apart, into
truth/ and each run's truth.csv, to compare answers with.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from vidtrack.errors import VidtrackError
from vidtrack.simulate.films import clips, recordings
from vidtrack.simulate.records import MARK, tables
from vidtrack.simulate.scenario import Scenario

UNFINISHED = ".simulating-"
"""How the name of a folder begins in which an experiment is made."""


def set_up(scenario: Scenario, folder: str, *, threads: int | None = None) -> list[str]:
    """Write the experiment folder of a scenario; the paths written, inside the folder.

    The same scenario gives the same bytes, whatever the number of threads: each file draws its own random numbers,
    from the scenario's seed and the file's name, so that adding a run or a camera changes no other file.
    A new folder appears whole or not at all; one that was simulated before is written over, file by file.
    Raises VidtrackError for a folder that holds something that was not simulated.
    """
    if os.path.isdir(folder) and os.listdir(folder) and not os.path.isfile(os.path.join(folder, MARK)):
        raise VidtrackError(f"{folder}: holds files that were not simulated. Name a new folder, or empty this one.")
    if os.path.isdir(folder):
        return _written(scenario, folder, threads)
    parent = os.path.dirname(os.path.abspath(folder))
    os.makedirs(parent, exist_ok=True)
    begins = f"{UNFINISHED}{os.path.basename(os.path.abspath(folder))[:200]}-"
    _remove_left(parent, begins)
    with tempfile.TemporaryDirectory(prefix=begins, dir=parent) as room, _locked(room):
        unfinished = os.path.join(room, "experiment")
        paths = _written(scenario, unfinished, threads)
        os.rename(unfinished, folder)
    return paths


@contextmanager
def _locked(room: str) -> Iterator[bool]:
    """Whether this process, and no other, has locked a folder; the lock ends with the process, however that ends."""
    handle = os.open(room, os.O_RDONLY)
    try:
        yield _lock(handle)
    finally:
        os.close(handle)


def _lock(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:  # another has it, or the file system has no locks
        return False
    return True


def _remove_left(parent: str, begins: str) -> None:
    """Remove the unfinished folders of processes that were killed: no one has locked them."""
    for name in os.listdir(parent):
        room = os.path.join(parent, name)
        if name.startswith(begins) and os.path.isdir(room):
            with _locked(room) as left:
                if left:
                    shutil.rmtree(room, ignore_errors=True)


def _written(scenario: Scenario, folder: str, threads: int | None) -> list[str]:
    tasks = [*tables(scenario), *clips(scenario), *recordings(scenario)]
    write = [(os.path.join(folder, path), writer) for path, writer in tasks]
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        list(pool.map(lambda task: task[1](task[0]), write))
    return [path for path, _ in tasks]


def planned_files(scenario: Scenario) -> list[str]:
    """The paths, inside the folder, that `set_up` writes. Nothing is drawn or written."""
    return [path for path, _ in (*tables(scenario), *clips(scenario), *recordings(scenario))]

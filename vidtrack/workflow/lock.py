"""Why Snakemake refuses to work in a folder: another one works there, or one was killed and left its lock."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress


def is_locked(folder: str) -> bool:
    """Whether a Snakemake that works in `folder`, or was killed there, has locked it."""
    locks = os.path.join(folder, ".snakemake", "locks")
    return os.path.isdir(locks) and bool(os.listdir(locks))


def why_locked(folder: str) -> str:
    """One line on who holds the lock of `folder`, and what to do."""
    holder = at_work(folder)
    if holder:
        return f"vidtrack: another snakemake works in this folder (process {holder}). Wait for its end, or stop it."
    return (
        "vidtrack: a snakemake that worked in this folder was killed and left its lock. Call snakemake --unlock, then "
        "snakemake again; unless one works here from another computer: wait for its end."
    )


def remove_lock(folder: str) -> None:
    """Take away the lock that a Snakemake left in `folder`: only where none works there."""
    shutil.rmtree(os.path.join(folder, ".snakemake", "locks"), ignore_errors=True)


def at_work(folder: str) -> int | None:
    """The process of another Snakemake on this computer whose working directory is `folder`, if it can be seen."""
    try:
        processes = [int(name) for name in os.listdir("/proc") if name.isdigit()]
    except OSError:
        return None
    for process in sorted(processes):
        with suppress(OSError):
            if process != os.getpid() and os.path.samefile(f"/proc/{process}/cwd", folder):
                with open(f"/proc/{process}/cmdline", "rb") as file:
                    if b"snakemake" in file.read():
                        return process
    return None

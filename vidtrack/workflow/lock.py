"""Why Snakemake refuses to work in a folder: another one works there, or one was killed and left its lock."""

from __future__ import annotations

import json
import os
import shutil
import socket
from contextlib import suppress
from typing import Any

from vidtrack.files.atomic import replacing

HOLDER = "holder.json"
"""Who holds the lock: a file beside Snakemake's own, which goes with them."""


def is_locked(folder: str) -> bool:
    """Whether a Snakemake that works in `folder`, or was killed there, has locked it."""
    locks = _locks(folder)
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
    shutil.rmtree(_locks(folder), ignore_errors=True)


def note_holder(folder: str) -> None:
    """Note that this process holds the lock of `folder`; where that cannot be written, the work goes on without."""
    holder = {**_computer(), "process": os.getpid(), "started": _started(os.getpid())}
    with suppress(OSError), replacing(os.path.join(_locks(folder), HOLDER)) as file:
        file.write(json.dumps(holder).encode())


def killed_holder(folder: str) -> int | None:
    """The process that locked `folder` and is certainly gone; None where it may be at work, here or elsewhere."""
    try:
        with open(os.path.join(_locks(folder), HOLDER), encoding="utf-8") as file:
            holder = json.load(file)
        process, started = int(holder["process"]), holder["started"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    here = _computer()
    same = here["machine"] and all(holder.get(part) == here[part] for part in ("machine", "host"))
    if not same or started is None:
        return None
    if holder.get("boot") != here["boot"]:  # it has been started again since
        return process
    if holder.get("processes") != here["processes"]:  # a container: its processes cannot be seen
        return None
    return None if _started(process) == started else process


def free_of_killed(folder: str) -> int | None:
    """Take away the lock of a Snakemake that is certainly gone; its process. None where there is no such lock."""
    locks = _locks(folder)
    if not (process := killed_holder(folder)):
        return None
    aside = f"{locks}.{os.getpid()}"
    try:
        os.rename(locks, aside)  # of two that find it at once, one has it
    except OSError:
        return None
    os.makedirs(locks, exist_ok=True)  # Snakemake has made it, and expects it
    shutil.rmtree(aside, ignore_errors=True)
    return process


def _locks(folder: str) -> str:
    return os.path.join(folder, ".snakemake", "locks")


def _computer() -> dict[str, Any]:
    """What distinguishes this computer, its last start, and the processes that can be seen here, from others."""

    def text(path: str) -> str:
        try:
            with open(path, encoding="utf-8") as file:
                return file.read().strip()
        except OSError:
            return ""

    try:
        processes = os.readlink("/proc/self/ns/pid")
    except OSError:
        processes = ""
    return {
        "host": socket.gethostname(),
        "machine": text("/etc/machine-id") or text("/proc/sys/kernel/random/boot_id"),
        "boot": text("/proc/sys/kernel/random/boot_id"),
        "processes": processes,
    }


def _started(process: int) -> str | None:
    """When a process began, as the kernel counts; None where there is none: a number is given again to others."""
    try:
        with open(f"/proc/{process}/stat", encoding="utf-8", errors="replace") as file:
            fields = file.read().rpartition(")")[2].split()
    except OSError:
        return None
    return fields[19] if fields[0] != "Z" else None


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

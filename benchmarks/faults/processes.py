"""The processes of a Snakemake at work: those of its session, the server of small jobs among them, and its workers."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

HOUSE = Path(__file__).resolve().parents[2]

LONGEST_S = 60.0
"""How long a call's processes may outlive it."""


def command(folder: Path) -> list[str]:
    """How Snakemake is called over a folder."""
    return [sys.executable, "-m", "snakemake", "-s", f"{HOUSE}/Snakefile", "--directory", str(folder), "--cores", "2"]


def end_of_session(leader: int) -> list[int]:
    """Wait for what the session's leader left running, as a person does who sees the machine still at work.

    The processes that are there after a minute are ended; their numbers.
    """
    end = time.monotonic() + LONGEST_S
    while left := session(leader):
        if time.monotonic() > end:
            break
        time.sleep(0.1)
    for pid in left:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return left


def session(leader: int) -> list[int]:
    """Processes of a session that are not dead."""
    return list(_states(leader))


class State(NamedTuple):
    """Of a process: the kernel's letter, and its parent."""

    letter: str
    parent: int


def _states(leader: int) -> dict[int, State]:
    """The processes of a session that are not dead."""
    found = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                fields = Path(f"/proc/{entry}/stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == leader and fields[0] != "Z":
                found[int(entry)] = State(fields[0], int(fields[1]))
    return found


def servers(leader: int) -> tuple[list[int], dict[int, State]]:
    """The server of small jobs of a session (several, if ever there were such), and the workers that it forked."""
    states = _states(leader)
    named = {pid: state for pid, state in states.items() if "vidtrack.workflow.job_server" in _command_of(pid)}
    return [pid for pid in named if named[pid].parent not in named], {
        pid: state for pid, state in named.items() if state.parent in named
    }


def _command_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


def at_work(leader: int) -> list[int]:
    """Workers that are at a job just now, as far as the kernel shows it: one that waits for a job sleeps."""
    return [pid for pid, state in servers(leader)[1].items() if state.letter in "RD"]

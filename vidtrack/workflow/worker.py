"""A process that does one small job after another: what the libraries set up on their first use is there for the next.

The server (see job_server.py) forks it and gives it jobs; a process of its own for each job took twice the processor
time, of which the job's work was half. What a job has of its caller is put in place anew each time: environment,
folder, umask, channels, signals. After a job that failed, and after some hundred, the process ends.
"""

from __future__ import annotations

import io
import os
import resource
import signal
import socket
import struct
import sys
import tempfile
import time
import warnings
from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from vidtrack.parent import die_with
from vidtrack.workflow import entry

MOST = 200
"""Jobs of a process, so that what a library does not give back cannot add up."""

USED = struct.Struct("!3i")
"""How a job ended: its exit code, ms of processor time, KB of memory that its process held at most."""


class Asked(NamedTuple):
    """What a caller asks for: a rule with its arguments, and all that a process has of its parent."""

    umask: int
    folder: str
    order: str
    arguments: list[str]
    environment: dict[str, str]


class Request(NamedTuple):
    """What a caller sent: its words as they came, and its standard output and error."""

    body: bytes
    channels: list[int]

    def close(self) -> None:
        """Let go of the channels."""
        for channel in self.channels:
            os.close(channel)


def received(caller: socket.socket) -> Request:
    """A request; ValueError where it breaks off."""
    head, channels, _, _ = socket.recv_fds(caller, 4, 2)
    try:
        if len(channels) != 2 or len(head) != 4:
            raise ValueError("no job was asked for")
        (length,) = struct.unpack("!I", head)
        body = b""
        while len(body) < length:
            if not (part := caller.recv(length - len(body))):
                raise ValueError("the caller broke off")
            body += part
        return Request(body, channels)
    except (OSError, ValueError):
        for channel in channels:
            os.close(channel)
        raise


def passed_on(request: Request, worker: socket.socket) -> None:
    """Give a request to another process; OSError where that is gone."""
    socket.send_fds(worker, [struct.pack("!I", len(request.body))], request.channels)
    worker.sendall(request.body)


def asked_in(body: bytes) -> Asked:
    """What a request says; ValueError where it is not as callers write it."""
    umask, folder, order, many, *words = os.fsdecode(body).split("\0")
    environment = dict(word.split("=", 1) for word in words[int(many) :])
    return Asked(int(umask), folder, order, words[: int(many)], environment)


def rule_of(body: bytes) -> str:
    """The rule that a request asks for; "" where it is not as callers write it."""
    with suppress(ValueError):
        return "".join(asked_in(body).arguments[:1])
    return ""


def work(
    parent: int, server: socket.socket, learnt: socket.socket, others: Iterable[socket.socket], share: int = MOST
) -> None:
    """Become a worker; never returns.

    parent   the server's process
    server   where jobs come from, and where it is said how each ended
    learnt   whom to say, at the end, which modules jobs have imported
    others   what belongs to the server alone
    share    how many jobs it does
    """
    known = set(sys.modules)
    try:
        die_with(parent)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        for other in others:
            other.close()
        for _ in range(share):
            request = received(server)
            begun = _processor_s()
            _forget_the_most()
            _be_called(rule_of(request.body))
            code = _done(asked_in(request.body), request.channels)
            server.sendall(USED.pack(code, round(1000 * (_processor_s() - begun)), _most_memory()))
            if code:
                break
    except (OSError, ValueError):  # the server needs it no longer
        pass
    finally:
        with suppress(OSError):
            learnt.send(" ".join(name for name in list(sys.modules) if name not in known).encode())
        os._exit(0)


def _done(asked: Asked, channels: list[int]) -> int:
    """Do a job as a process of its own would; its exit code."""
    code = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        for number, channel in enumerate(channels, start=1):
            os.dup2(channel, number)
            os.close(channel)
        os.environ.clear()
        os.environ.update(asked.environment)
        os.umask(asked.umask)
        os.chdir(asked.folder)
        tempfile.tempdir = None
        sys.stdin = io.StringIO(asked.order)
        with warnings.catch_warnings():  # each job warns anew
            code = entry.main(asked.arguments)
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except KeyboardInterrupt:
        code = 130
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        _let_go_of_channels()
    return code


def _let_go_of_channels() -> None:
    nothing = os.open(os.devnull, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(nothing, number)
    os.close(nothing)


def _be_called(rule: str) -> None:
    """Let lists of processes show which job is at work, where the kernel can."""
    with suppress(OSError), open("/proc/self/comm", "w", encoding="ascii", errors="replace") as file:
        file.write(rule)


def _forget_the_most() -> None:
    """Let the mark of the most memory begin anew, where the kernel can."""
    with suppress(OSError), open("/proc/self/clear_refs", "w", encoding="ascii") as file:
        file.write("5")


def _processor_s() -> float:
    """Processor time of this process and of those that it has waited for, s."""
    waited = os.times()
    return time.process_time() + waited.children_user + waited.children_system


def _most_memory() -> int:
    """KB that this process held at most, since the mark was put back, and the largest of those that it waited for.

    0 where the kernel does not say.
    """
    with suppress(OSError, ValueError), open("/proc/self/status", encoding="ascii", errors="replace") as file:
        for line in file:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) + resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return 0

"""A process that has loaded the libraries once and forks workers for jobs: their start costs no imports.

    python -m vidtrack.workflow.job_server SOCKET NUMBER

The socket listens already, as the file with this number that the process has of its parent.

Each worker (see worker.py) does one job after another; one that decodes recordings has a worker for itself alone. What
jobs import beyond the libraries is loaded here too, for the workers that come after.

It serves one call of Snakemake: when its standard input is closed, it ends its workers, removes its socket and the
folder of that, and ends, so that a Snakemake that was killed leaves no job at work and no file. A worker whose
caller is gone is killed. Nothing but imports is done before a fork: no thread runs and no file is open then.
"""

from __future__ import annotations

import gc
import importlib
import os
import selectors
import signal
import socket
import struct
import sys
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from vidtrack.workflow import entry
from vidtrack.workflow.small_jobs import LARGE, remove_socket
from vidtrack.workflow.worker import MOST, USED, Request, passed_on, received, rule_of, work

LIBRARIES = (
    "numpy",
    "scipy.interpolate",
    "scipy.optimize",
    "pyarrow.parquet",
    "pandas",
    "cv2",
    "PIL.PngImagePlugin",
    "jinja2",
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
)
"""What small jobs import, and what costs them most of their time."""


class Worker:
    """The server's side of a worker.

    caller   who waits for its job; None where it has none, or that one is gone
    idle     whether it waits for a job
    left     how many jobs it will still take
    """

    def __init__(self, process: int, channel: socket.socket, share: int = MOST) -> None:
        self.process, self.channel = process, channel
        self.caller: socket.socket | None = None
        self.idle, self.left = True, share


class Server:
    """The sockets and the workers, by their channels."""

    def __init__(self, listener: socket.socket) -> None:
        self.listener = listener
        self.workers: dict[socket.socket, Worker] = {}
        self.ready = selectors.DefaultSelector()
        self._learnt, self._taught = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._taught.setblocking(False)

    def serve(self) -> None:
        """Have a worker do the job of each caller, until the standard input is closed."""
        for heard in (sys.stdin, self.listener, self._learnt):
            self.ready.register(heard, selectors.EVENT_READ)
        while True:
            for key, _ in self.ready.select():
                source: Any = key.fileobj
                if source is sys.stdin:
                    return self._end()
                if source is self.listener:
                    self._begin()
                elif source is self._learnt:
                    load(self._learnt.recv(1 << 20).decode().split())
                elif source in self.workers:
                    self._collect(self.workers[source])
                elif any(worker.caller is source for worker in self.workers.values()):  # it may have ended just now
                    self._caller_is_gone(source)

    def _begin(self) -> None:
        caller, _ = self.listener.accept()
        try:
            caller.settimeout(10)
            request = received(caller)
        except (OSError, ValueError, struct.error):
            caller.close()
            return
        worker = self._given(request)
        request.close()
        worker.caller = caller
        self.ready.register(caller, selectors.EVENT_READ)
        with suppress(OSError):
            caller.sendall(struct.pack("!i", worker.process))

    def _given(self, request: Request) -> Worker:
        """The worker that has the job now: the one that was idle last, whose memory is warm, or a new one."""
        alone = rule_of(request.body) in LARGE
        for worker in [*reversed(self.workers.values())]:
            if worker.idle and worker.left and not alone:
                worker.idle = False
                with suppress(OSError):  # where it was killed meanwhile
                    passed_on(request, worker.channel)
                    return worker
        worker = self._forked(request, 1 if alone else MOST)
        worker.idle = False
        with suppress(OSError):
            passed_on(request, worker.channel)
        return worker

    def _forked(self, request: Request, share: int) -> Worker:
        """A new worker for so many jobs. request: it must not hold that beyond its job, so it gets it as any other."""
        ours, theirs = socket.socketpair()
        server, process = os.getpid(), os.fork()
        if not process:
            request.close()
            callers = [worker.caller for worker in self.workers.values() if worker.caller is not None]
            work(server, theirs, self._taught, [self.listener, self._learnt, ours, *self.workers, *callers], share)
        theirs.close()
        worker = self.workers[ours] = Worker(process, ours, share)
        self.ready.register(ours, selectors.EVENT_READ)
        return worker

    def _collect(self, worker: Worker) -> None:
        """Say to the caller how its job ended, or that its process did."""
        said = b""
        with suppress(OSError):
            said = worker.channel.recv(USED.size, socket.MSG_WAITALL)
        if len(said) == USED.size:
            worker.idle, worker.left = True, 0 if USED.unpack(said)[0] else worker.left - 1
        else:
            self.ready.unregister(worker.channel)
            worker.channel.close()
            del self.workers[worker.channel]
            _, status, used = os.wait4(worker.process, 0)
            # it may end only between jobs: a job that it never said to be done is not
            said = USED.pack(os.waitstatus_to_exitcode(status) or 1, round(1000 * used.ru_utime), used.ru_maxrss)
        if worker.caller is not None:
            self.ready.unregister(worker.caller)
            with suppress(OSError), worker.caller:
                worker.caller.sendall(said)
            worker.caller = None

    def _caller_is_gone(self, caller: socket.socket) -> None:
        self.ready.unregister(caller)
        caller.close()
        for worker in self.workers.values():
            if worker.caller is caller:
                worker.caller = None
                os.kill(worker.process, signal.SIGKILL)

    def _end(self) -> None:
        for worker in self.workers.values():
            os.kill(worker.process, signal.SIGKILL)
        for worker in self.workers.values():
            os.waitpid(worker.process, 0)


def load(names: Iterable[str]) -> None:
    """Import modules, and let those of ours that have a `prepare` do so; what fails is left to the job that wants it.

    All that is there then counts as permanent: the forked jobs' garbage collectors need not go through it, nor copy it.
    """
    for name in names:
        with suppress(Exception):
            module = importlib.import_module(name)
            if name.startswith("vidtrack."):
                getattr(module, "prepare", tuple)()
    gc.collect()
    gc.freeze()


def main(place: str, listening: int) -> int:
    """Load the libraries and serve those who call at `place`, where the file with this number listens."""
    for number in (signal.SIGINT, signal.SIGTERM):  # they end jobs, and Snakemake; the server ends after both
        signal.signal(number, signal.SIG_IGN)
    with socket.socket(fileno=listening) as listener:
        listener.set_inheritable(False)
        load([*LIBRARIES, entry.__name__])
        try:
            Server(listener).serve()
        finally:
            remove_socket(place)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))

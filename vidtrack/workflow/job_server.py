"""A process that has loaded the libraries once and forks each small job: its start then costs hundredths of a second.

    python -m vidtrack.workflow.job_server SOCKET

What a rule imports beyond that is learnt from its second job, and loaded for those after it: a season has many.

It serves one call of Snakemake: when its standard input is closed, it ends its jobs, removes its socket and the folder
of that, and ends, so that a Snakemake that was killed leaves no small job at work and no file. A job whose caller is
gone is killed too. Nothing but imports is done before a fork: no thread runs and no file is open then, and a job does
what it would do in a process of its own.
"""

from __future__ import annotations

import ctypes
import gc
import importlib
import io
import os
import selectors
import signal
import socket
import struct
import sys
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from typing import Any, NamedTuple

from vidtrack.workflow import entry

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

_PARENT_DIED = 1  # PR_SET_PDEATHSIG of Linux

_ENDED = os.WEXITED | os.WNOHANG | os.WNOWAIT
"""Whether a process has ended, which stays to be asked again."""


class Asked(NamedTuple):
    """What a caller asks for: a rule with its arguments, and all that a process has of its parent."""

    umask: int
    folder: str
    order: str
    arguments: list[str]
    environment: dict[str, str]


class Server:
    """The sockets and the jobs at work.

    jobs    the process of each job: the connection to its caller, None where the caller is gone
    ended   those of them that have ended, and are kept by their number until their caller has taken note
    asked   how often each rule was asked for
    """

    def __init__(self, listener: socket.socket) -> None:
        self.listener = listener
        self.jobs: dict[int, socket.socket | None] = {}
        self.ended: set[int] = set()
        self.asked: Counter[str] = Counter()
        self.ready = selectors.DefaultSelector()
        woken, waker = socket.socketpair()
        for end in (woken, waker):
            end.setblocking(False)
        self._woken, self._waker = woken, waker
        self._learnt, self._taught = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._taught.setblocking(False)

    def serve(self) -> None:
        """Fork a job for each caller, until the standard input is closed."""
        signal.set_wakeup_fd(self._waker.fileno(), warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        for source in (sys.stdin, self.listener, self._woken, self._learnt):
            self.ready.register(source, selectors.EVENT_READ)
        while True:
            for key, _ in self.ready.select():
                if key.fileobj is sys.stdin:
                    return self._end()
                if key.fileobj is self.listener:
                    self._fork()
                elif key.fileobj is self._learnt:
                    load(self._learnt.recv(1 << 20).decode().split())
                elif key.fileobj is self._woken:
                    with suppress(BlockingIOError):
                        self._woken.recv(4096)
                    self._collect()
                else:
                    self._caller_is_gone(key.fileobj)

    def _fork(self) -> None:
        caller, _ = self.listener.accept()
        try:
            caller.settimeout(10)
            asked, channels = received(caller)
        except (OSError, ValueError, struct.error):
            caller.close()
            return
        rule = next(iter(asked.arguments), "")
        self.asked[rule] += 1
        process = os.fork()
        if not process:
            callers = [one for one in self.jobs.values() if one is not None]
            others = [self.listener, self._woken, self._waker, self._learnt, caller, *callers]
            _run(asked, channels, others, self._taught if self.asked[rule] == 2 else None)
        for channel in channels:
            os.close(channel)
        self.jobs[process] = caller
        self.ready.register(caller, selectors.EVENT_READ)
        with suppress(OSError):
            caller.sendall(struct.pack("!i", process))

    def _collect(self) -> None:
        """Give the callers the exit codes of jobs that have ended."""
        for process, caller in list(self.jobs.items()):
            if process in self.ended or (ended := os.waitid(os.P_PID, process, _ENDED)) is None:
                continue
            if caller is None:
                self._forget(process)
                continue
            self.ended.add(process)
            with suppress(OSError):
                caller.sendall(struct.pack("!i", _exit_code(ended)))

    def _caller_is_gone(self, caller: Any) -> None:
        self.ready.unregister(caller)
        caller.close()
        for process in [process for process, its in self.jobs.items() if its is caller]:
            if process in self.ended:
                self._forget(process)
            else:
                self.jobs[process] = None
                os.kill(process, signal.SIGKILL)

    def _forget(self, process: int) -> None:
        """Let go of a process that has ended; only now may another one get its number."""
        os.waitpid(process, 0)
        self.ended.discard(process)
        del self.jobs[process]

    def _end(self) -> None:
        for process in self.jobs:
            os.kill(process, signal.SIGKILL)
        for process in self.jobs:
            os.waitpid(process, 0)


def received(caller: socket.socket) -> tuple[Asked, list[int]]:
    """What a caller asks for, and its standard output and error; ValueError where it breaks off."""
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
        umask, folder, order, many, *words = os.fsdecode(body).split("\0")
        environment = dict(word.split("=", 1) for word in words[int(many) :])
        return Asked(int(umask), folder, order, words[: int(many)], environment), channels
    except (OSError, ValueError):
        for channel in channels:
            os.close(channel)
        raise


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


def _run(asked: Asked, channels: list[int], others: list[socket.socket], taught: socket.socket | None) -> None:
    """Become the job; never returns.

    taught  whom to say which modules the job has imported
    """
    code, known = 1, set(sys.modules)
    try:
        _die_with_the_server()
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        for number, channel in enumerate(channels, start=1):
            os.dup2(channel, number)
            os.close(channel)
        for other in others:
            other.close()
        os.environ.clear()
        os.environ.update(asked.environment)
        os.umask(asked.umask)
        os.chdir(asked.folder)
        sys.stdin = io.StringIO(asked.order)
        code = entry.main(asked.arguments)
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    finally:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        if taught is not None and not code:
            with suppress(OSError):
                taught.send(" ".join(name for name in list(sys.modules) if name not in known).encode())
        os._exit(code)


def _exit_code(ended: Any) -> int:
    """As `os.waitstatus_to_exitcode`: negative where a signal ended the process."""
    return int(ended.si_status if ended.si_code == os.CLD_EXITED else -ended.si_status)


def _die_with_the_server() -> None:
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_PARENT_DIED, signal.SIGKILL)


def main(place: str) -> int:
    """Listen at `place`, load the libraries, serve."""
    for number in (signal.SIGINT, signal.SIGTERM):  # they end jobs, and Snakemake; the server ends after both
        signal.signal(number, signal.SIG_IGN)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(place)
        listener.listen(64)
        load([*LIBRARIES, entry.__name__])
        try:
            Server(listener).serve()
        finally:
            _remove(place)
    return 0


def _remove(place: str) -> None:
    """The socket, what jobs noted beside it, and its folder where that holds nothing else."""
    folder = os.path.dirname(os.path.abspath(place))
    with suppress(OSError):
        os.unlink(place)
        for name in os.listdir(folder):
            if name.startswith("said-"):
                os.unlink(os.path.join(folder, name))
        os.rmdir(folder)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))

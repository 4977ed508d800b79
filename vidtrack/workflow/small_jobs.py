"""Where a job runs: forked by the server that has loaded the libraries (see job_server.py), or in this process.

Imports nothing but what Python itself has: this is what each job's start still costs.
"""

from __future__ import annotations

import io
import os
import socket
import struct
import sys

TYPE_CHECKING = False  # importing typing would cost each job's start more than all else of it
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

SERVER = "VIDTRACK_JOB_SERVER"
"""The variable of the environment that names the server's socket, its Snakemake and the Python that both run in."""

LARGE = (
    "track",
    "track_wand",
    "calibration_points",
    "board_corners",
    "clocks",
    "waterline",
    "overlay_film",
    "render",
)
"""Rules that decode recordings: each job has a process of its own, so that the memory measured of it is its own."""


PREFIX = "vidtrack-"
"""How the folder of a server's socket is called, among those of other programs."""

BEGINNING_S = 60.0
"""How old an empty folder must be before no server is about to begin in it."""

PATIENCE_S = 10.0
"""How long the server may take to end: while it loads libraries it hears nothing."""


class JobServer:
    """The server of one call of Snakemake; it starts when it is made, and ends with this process at the latest."""

    def __init__(self) -> None:
        import subprocess
        import tempfile

        remove_left(tempfile.gettempdir())
        self._folder = tempfile.mkdtemp(prefix=PREFIX)
        place = os.path.join(self._folder, "jobs")
        with socket.socket(socket.AF_UNIX) as listener:  # jobs that come before the server is ready wait for it
            listener.bind(f"{place}.new")
            listener.listen(64)
            os.rename(f"{place}.new", place)  # where it is found, someone listens
            self._process = subprocess.Popen(
                [sys.executable, "-m", "vidtrack.workflow.job_server", place, str(listener.fileno())],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                pass_fds=[listener.fileno()],
            )
        os.environ[SERVER] = f"{place}\n{os.getpid()}\n{_this_python()}"

    def end(self) -> None:
        """End the server and all that it still runs."""
        import shutil
        from contextlib import suppress
        from subprocess import TimeoutExpired

        os.environ.pop(SERVER, None)
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout=PATIENCE_S)
        except TimeoutExpired:  # still loading libraries, on a busy machine; its jobs die with it
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)


def remove_left(room: str) -> None:
    """Remove the folders of servers that were killed together with their Snakemake: nothing listens there any more.

    A folder of someone's that is called alike is left alone, whatever it holds.
    """
    import stat

    for name in os.listdir(room):
        if not name.startswith(PREFIX):
            continue
        folder = os.path.join(room, name)
        place = os.path.join(folder, "jobs")
        try:
            if not os.path.lexists(place):
                _remove_begun(folder)
            elif stat.S_ISSOCK(os.lstat(place).st_mode) and _is_dead(place):
                remove_socket(place)
        except OSError:  # of another person, or gone meanwhile
            continue


def _is_dead(place: str) -> bool:
    """Whether nothing listens at a socket any more; OSError where that cannot be seen."""
    with socket.socket(socket.AF_UNIX) as server:
        server.settimeout(1)
        try:
            server.connect(place)
        except ConnectionRefusedError:
            return True
    return False


def _remove_begun(folder: str) -> None:
    """Remove a folder in which no server began: its Snakemake was killed before, and some time ago."""
    import re
    import stat
    import time

    made = os.lstat(folder)
    ours = stat.S_ISDIR(made.st_mode) and stat.S_IMODE(made.st_mode) == 0o700 and made.st_uid == os.getuid()
    if not ours or not re.fullmatch(f"{PREFIX}[a-z0-9_]{{8}}", os.path.basename(folder)):  # as tempfile draws it
        return
    if time.time() - made.st_mtime < BEGINNING_S:
        return
    new = os.path.join(folder, "jobs.new")
    if os.listdir(folder) == ["jobs.new"] and stat.S_ISSOCK(os.lstat(new).st_mode) and _is_dead(new):
        os.unlink(new)
    os.rmdir(folder)


def remove_socket(place: str) -> None:
    """Remove a server's socket, what jobs noted beside it, and its folder where that holds nothing else."""
    folder = os.path.dirname(os.path.abspath(place))
    try:
        os.unlink(place)
        for name in os.listdir(folder):
            if name.startswith("said-"):
                os.unlink(os.path.join(folder, name))
        os.rmdir(folder)
    except OSError:
        pass


def server_folder() -> str:
    """The folder of the server's socket, which lasts as long as the call of Snakemake; "" where there is no server."""
    return os.path.dirname(os.environ.get(SERVER, "").split("\n")[0])


def run_by_server(arguments: Sequence[str]) -> int | None:
    """The exit code of a job that the server ran; None where no server runs it, and it is still to be done."""
    place, snakemake, python, *_ = [*os.environ.get(SERVER, "").split("\n"), "", ""]
    if not place or python != _this_python() or not arguments:
        return None
    with socket.socket(socket.AF_UNIX) as server:
        try:
            server.connect(place)
        except OSError:
            return None
        order = sys.stdin.read()
        sys.stdin = io.StringIO(order)  # it can be read but once, and may be wanted again
        try:
            ask(server, arguments, order, os.environ)
            answered(server)
            ended = answered(server, 3)
        except OSError:
            ended = None
    if ended is not None:
        return exit_code(ended[0])
    # the server was killed, and the job with it: one more try here, unless Snakemake is gone too
    try:
        os.kill(int(snakemake), 0)
    except (OSError, ValueError):
        return 1
    return None


def ask(server: socket.socket, arguments: Sequence[str], order: str, environment: Mapping[str, str]) -> None:
    """Ask the server for a job; it answers with the number of the job's process.

    At the end, it says the exit code, negative where a signal ended the job, how many ms of processor time the job took
    and how many KB of memory it held at most.
    """
    umask = os.umask(0)
    os.umask(umask)
    variables = [f"{name}={value}" for name, value in environment.items()]
    body = packed([str(umask), os.getcwd(), order, str(len(arguments)), *arguments, *variables])
    socket.send_fds(server, [struct.pack("!I", len(body))], [1, 2])
    server.sendall(body)


def packed(words: Sequence[str]) -> bytes:
    """Words of which none holds a NUL, as none can that a process is given, in one piece of bytes."""
    return os.fsencode("\0".join(words))


def answered(server: socket.socket, many: int = 1) -> tuple[int, ...] | None:
    """The next numbers that the server says; None where it is gone."""
    answer = b""
    while len(answer) < 4 * many:
        try:
            part = server.recv(4 * many - len(answer))
        except KeyboardInterrupt:  # the job gets it too
            continue
        if not part:
            return None
        answer += part
    return struct.unpack(f"!{many}i", answer)


def exit_code(code: int) -> int:
    """As a shell says it."""
    return code if code >= 0 else 128 - code


def _this_python() -> str:
    return f"{sys.executable} {os.path.dirname(os.path.dirname(os.path.abspath(__file__)))}"

"""What jobs say on the terminal: each line once in a call of Snakemake, and one of all that a full disk hinders."""

from __future__ import annotations

import errno
import hashlib
import os
import sys
from collections.abc import Iterable

from vidtrack.files.atomic import meant
from vidtrack.workflow.small_jobs import server_folder

CURES = {
    errno.ENOSPC: "Free some space",
    errno.EDQUOT: "Free some space, or have the quota raised",
    errno.EFBIG: "Allow larger files (ulimit -f), or use another file system",
    errno.EROFS: "Make the file system writable",
    errno.EACCES: "Correct its permissions",
    errno.EPERM: "Correct its permissions",
    errno.EISDIR: "Move the folder",
    errno.ENOTDIR: "Move the file that is in the way",
    errno.EEXIST: "Move what is in the way",
    errno.EMFILE: "Allow more open files (ulimit -n)",
    errno.ENFILE: "End other programs",
    errno.ENOENT: "Put it there",
}
"""What to do about what the system refuses."""

ANYWHERE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG)
"""What holds for a whole file system: of all that it hinders, one line is enough."""


class Speaker:
    """The lines of one job.

    Two jobs of one call of Snakemake that meet the same hindrance say it once.
    """

    def __init__(self) -> None:
        self._said: set[str] = set()

    def say(self, problems: Iterable[str]) -> None:
        """Problems, a line each."""
        for problem in problems:
            self._once(problem, problem)

    def say_refused(self, error: OSError, where: str) -> None:
        """What the system refused.

        where   the file or folder, for errors that name none
        """
        key = refused(error, where)
        if error.errno in ANYWHERE:
            key = f"{error.errno} {_device(str(error.filename or where))}"
        self._once(key, refused(error, where))

    def _once(self, key: str, line: str) -> None:
        if key not in self._said and _first(key):
            sys.stderr.write(f"vidtrack: {line}\n")
        self._said.add(key)


def refused(error: OSError, where: str) -> str:
    """What the system refused, where, and what to do."""
    place = meant(str(error.filename)) if error.filename else where
    cure = CURES.get(error.errno or 0, "Correct the cause")
    reason = " ".join(str(error.strerror or error).split())
    return f"{place + ': ' if place else ''}{reason}. {cure} and run again."


def _first(key: str) -> bool:
    """Whether no other job of this call of Snakemake has said it."""
    folder = server_folder()
    if not folder:
        return True
    name = f"said-{hashlib.sha256(key.encode('utf-8', 'surrogatepass')).hexdigest()[:16]}"
    try:
        os.close(os.open(os.path.join(folder, name), os.O_CREAT | os.O_EXCL | os.O_WRONLY))
    except FileExistsError:
        return False
    except OSError:
        return True
    return True


def _device(path: str) -> int:
    path = os.path.abspath(path)
    while not os.path.lexists(path):
        path = os.path.dirname(path)
    return os.lstat(path).st_dev

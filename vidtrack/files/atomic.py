"""Outputs appear whole or not at all: written under another name in the same folder, then renamed."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import IO

PARTIAL = ".partial"
"""How the names of unfinished files end."""


@contextmanager
def replacing(path: str | os.PathLike[str], mode: str = "wb") -> Iterator[IO[bytes]]:
    """A binary file that becomes `path` when the block ends well, and vanishes when it does not.

    A reader never meets half a file, and a second writer of the same path never mixes with the first.
    """
    path = os.fspath(path)
    folder = os.path.dirname(path) or "."
    os.makedirs(folder, exist_ok=True)
    handle, temporary = tempfile.mkstemp(prefix=_prefix(path), suffix=PARTIAL, dir=folder)
    try:
        with os.fdopen(handle, mode) as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        if os.path.exists(temporary):
            os.unlink(temporary)
        raise


def meant(path: str) -> str:
    """The path of the output, where `path` is that of its unfinished file."""
    folder, name = os.path.split(path)
    if name.startswith(".") and name.endswith(PARTIAL):
        name = name[1 : -len(PARTIAL)].rpartition(".")[0]
    return os.path.join(folder, name)


def remove_partial(path: str | os.PathLike[str]) -> None:
    """Remove what writers of `path` left that were killed. Only for the one who alone may write it."""
    folder, prefix = os.path.dirname(os.fspath(path)) or ".", _prefix(os.fspath(path))
    if os.path.isdir(folder):
        for name in os.listdir(folder):
            chance = name[len(prefix) : -len(PARTIAL)]  # as tempfile draws it: it has no dots
            if name.startswith(prefix) and name.endswith(PARTIAL) and "." not in chance:
                os.unlink(os.path.join(folder, name))


def remove_all_partial(folder: str) -> None:
    """Remove what killed writers left anywhere in a folder. Only while no one writes there."""
    for here, _, names in os.walk(folder):
        for name in names:
            if name.startswith(".") and name.endswith(PARTIAL):
                with suppress(OSError):
                    os.unlink(os.path.join(here, name))


def _prefix(path: str) -> str:
    return f".{os.path.basename(path)[:200]}."


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

"""Work that may kill its process: done in a child, so that it costs an error and not the job."""

from __future__ import annotations

import faulthandler
import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

T = TypeVar("T")


class ChildDied(Exception):
    """The child process ended without an answer."""


def in_child(work: Callable[[str], T], given: str) -> T:
    """What `work(given)` returns or raises, from a child process; ChildDied where that died of it.

    work   a function of a module; what it returns is pickled
    """
    try:
        here = multiprocessing.get_context("fork")
    except ValueError:
        here = multiprocessing.get_context("spawn")  # type: ignore[assignment]
    receiver, sender = here.Pipe(duplex=False)
    child = here.Process(target=_answer, args=(sender, work, given))
    child.start()
    sender.close()
    try:
        answer, error = receiver.recv()
    except (EOFError, OSError):
        child.join()
        raise ChildDied(f"reading it ended with code {child.exitcode}") from None
    finally:
        receiver.close()
    child.join()
    if error is not None:
        raise ValueError(error)
    return answer  # type: ignore[no-any-return]


def _answer(sender: Connection, work: Callable[[str], Any], given: str) -> None:
    faulthandler.disable()  # that it died is said by its parent, in a line
    answer: tuple[Any, str | None]
    try:
        answer = work(given), None
    except Exception as error:
        answer = None, f"{type(error).__name__}: {error}"
    sender.send(answer)

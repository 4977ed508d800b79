"""The one error that a user can correct: what is wrong, where, and what to do, on one line."""

from __future__ import annotations

from collections.abc import Sequence

MOST = 10
"""Problems of one kind that are shown; the rest is counted."""

LINES = 60
"""Problems of all kinds that are shown."""


LONGEST = 2000
"""Characters of a problem that are shown: its beginning and its end, where the cure stands."""


class VidtrackError(Exception):
    """Bad input: what is wrong, where, which value was met, and what to do, on one line.

    A job that meets it prints the line, writes no output and ends with exit code 1.
    Several problems may be reported together: pass each as its own argument. Of very many the rest is counted.
    """

    def __init__(self, *problems: str) -> None:
        problems = tuple(_one_line(problem) for problem in problems)
        super().__init__(*problems)
        self.problems: tuple[str, ...] = problems
        if len(problems) > LINES:
            self.problems = (*problems[:LINES], f"and {len(problems) - LINES} more problems.")

    def __str__(self) -> str:
        return "\n".join(self.problems)


def _one_line(problem: str) -> str:
    """A problem as a line, whatever names and values of files stand in it."""
    problem = _shortened(problem)
    if not problem.isprintable():
        # what breaks a line, moves the cursor of a terminal, turns the order of letters, is invisible, or is no letter
        problem = _shortened("".join(c if c.isprintable() else repr(c)[1:-1] for c in problem))
    return problem


def _shortened(problem: str) -> str:
    return problem if len(problem) <= LONGEST else f"{problem[: LONGEST - 400]} ... {problem[-395:]}"


def first_of(problems: Sequence[str], where: object, most: int = MOST) -> list[str]:
    """The first problems of one kind, and a line that says how many more there are at the place `where`."""
    more = len(problems) - most
    return [*problems[:most], f"{where}: and {more} more problems like these."] if more > 0 else list(problems)


def damaged(path: object, what: str, why: object) -> VidtrackError:
    """A file among the results that is not what it was when it was written."""
    reason = " ".join(str(why).split()) or type(why).__name__
    return VidtrackError(f"{path}: {what} ({reason[:120]}). Delete the file and run again.")

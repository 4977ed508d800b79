"""The head of a file of the old programs: its name, time, date and purpose, then a line of =."""

from __future__ import annotations

import time
from collections.abc import Sequence

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, leading_numbers, lines_of

RULE = "=" * 70
"""Shorter than the 79 characters that the old programs take as one line."""


def body_of(path: Path, what: str) -> list[tuple[int, str]]:
    """The lines after the header, each with its number in the file, blank ones left out.

    The header ends with the last line of =; without one, before the first line that begins with a number.
    """
    lines = lines_of(path)
    rules = [i for i, line in enumerate(lines) if line.strip().startswith("=====")]
    first = rules[-1] + 1 if rules else next((i for i, line in enumerate(lines) if leading_numbers(line)), len(lines))
    body = [(i + 1, line) for i, line in enumerate(lines) if i >= first and line.strip(" \t=")]
    if not body:
        raise VidtrackError(f"{path}: no {what} in it. Copy the whole file again.")
    return body


def header(name: str, lines: Sequence[str], *, height: int, now: float = 0.0) -> str:
    """A header of `height` lines, the line of = last, that programs may skip by counting.

    now   its time and date, s since 1970: with 0 the same numbers make the same bytes
    """
    moment = time.gmtime(now)
    top = [name, time.strftime("%H:%M:%S", moment), time.strftime("%m/%d/%y", moment), "", *lines]
    if len(top) > height - 1:
        raise ValueError(f"{len(top)} lines do not fit in a header of {height}")
    return "\n".join([*top, *[""] * (height - 1 - len(top)), RULE]) + "\n"


def row(path: Path, line: int, text: str, least: int, what: str) -> list[float]:
    """The numbers with which a line begins; VidtrackError where there are fewer than `least`."""
    found = leading_numbers(text)
    if len(found) < least:
        raise VidtrackError(
            f"{path}, line {line}: {len(found)} numbers where {what} has {least}. Copy the whole file again, or "
            "correct the line."
        )
    return found

"""Recordings whose names carry the time at which they began: those that began together are of one take."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

STAMP = re.compile(
    r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)[-_.T ]{0,3}"
    r"([0-2]\d)[-_.:h]?([0-5]\d)[-_.:m]?([0-5]\d)(?:\d{3})?(?!\d)",
    re.IGNORECASE,
)
"""20260314101500, 2026-03-14_10-15-00, 20260314T101500, with or without thousandths."""


@dataclass(frozen=True)
class Limits:
    """together_s: recordings of one take begin within so many seconds: people start their cameras one after another."""

    together_s: float = 20.0


LIMITS = Limits()


def one_time_a_take(stems: Mapping[str, tuple[str, str]]) -> dict[str, str] | None:
    """Names in which recordings that began together carry one time, that of the first; other times are left out.

    stems   path: (folder, name without its ending)
    None where a name has no time. Two recordings of one camera, whose names differ in times alone, are two takes.
    """
    began: list[tuple[datetime, str, tuple[str, str]]] = []
    for path, (folder, stem) in stems.items():
        found = STAMP.search(stem)
        try:
            time = datetime(*map(int, found.groups())) if found else None  # type: ignore[arg-type]
        except ValueError:  # the 31st of February
            time = None
        if time is None:
            return None
        began.append((time, path, (folder, STAMP.sub("", stem))))
    answer: dict[str, str] = {}
    first, seen = None, set[tuple[str, str]]()
    for time, path, rest in sorted(began):
        if first is None or rest in seen or time - first > timedelta(seconds=LIMITS.together_s):
            first, seen = time, set()
        seen.add(rest)
        answer[path] = f"{rest[1]}_{first:%Y%m%dT%H%M%S}"
    return answer

"""What a stage found that the user should know: how bad it is, what was seen, and what to do.

Each stage returns its findings, its job writes them under `findings` of the JSON record, and the verdict and the report
collect them from every record. A finding is made where the numbers are known; its words are final there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple, get_args

Level = Literal["note", "doubtful", "bad", "failed"]
"""note: worth knowing, nothing is wrong; doubtful: some numbers may be wrong, or worse than their sigma says; bad: do
not use these numbers; failed: there are none."""

LEVELS: tuple[Level, ...] = get_args(Level)


class Finding(NamedTuple):
    """One thing that the user should know.

    level   how bad it is
    code    a stable name of the kind, words joined by hyphens, for programs: `clock-unknown`
    text    what was seen and where, one sentence
    cure    what to do about it, one sentence; empty where nothing can be done
    """

    level: Level
    code: str
    text: str
    cure: str = ""


def as_records(findings: Iterable[Finding]) -> list[dict[str, str]]:
    """Findings as they are written to JSON."""
    return [finding._asdict() for finding in findings]


def from_records(records: Iterable[Mapping[str, Any]]) -> list[Finding]:
    """Findings as they were written to JSON."""
    return [Finding(**record) for record in records]


def worst_first(findings: Iterable[Finding]) -> list[Finding]:
    """Findings in falling order of their level; the order within a level is kept."""
    return sorted(findings, key=lambda finding: -LEVELS.index(finding.level))

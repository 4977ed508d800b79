"""The findings of a stage's record, whatever its depth and under whichever of three names they stand there."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from vidtrack.findings import Finding, from_records

SENTENCES = ("warnings", "problems")
"""Keys that hold lines of text: each is a doubt, its first sentence what was seen, the rest what to do."""


def collected(record: Mapping[str, Any] | None, where: str = "") -> list[Finding]:
    """All findings of a record, in its order, each once.

    where   put before a text that does not name it: the camera, where the record is one camera's
    Lines under `warnings` or `problems` count as doubtful, but for those that a finding of the record says already.
    """
    found: list[Finding] = []
    lines: list[str] = []
    for key, value in _walk(record or {}):
        if key == "findings":
            found += from_records(value)
        else:
            lines += [line for line in value if isinstance(line, str)]
    new = [line for line in dict.fromkeys(lines) if not any(_says(finding, line) for finding in found)]
    found += [_from_line(line) for line in new]
    return list(dict.fromkeys(placed(finding, where) for finding in found))


def placed(finding: Finding, where: str) -> Finding:
    """The finding with its place in front of its text, where the text does not name the place."""
    if not where or re.search(rf"(?<!\w){re.escape(where)}(?!\w)", finding.text):
        return finding
    return finding._replace(text=f"{where}: {finding.text}")


def _walk(record: Mapping[str, Any]) -> Iterator[tuple[str, Sequence[Any]]]:
    for key, value in record.items():
        if key == "provenance":
            continue
        if isinstance(value, (list, tuple)):
            if key == "findings" or key in SENTENCES:
                yield key, value
            for entry in value:
                if isinstance(entry, Mapping):
                    yield from _walk(entry)
        elif isinstance(value, Mapping):
            yield from _walk(value)


def _says(finding: Finding, line: str) -> bool:
    return finding.text.rstrip(". ") in line or line.rstrip(". ") in f"{finding.text} {finding.cure}"


def _from_line(line: str) -> Finding:
    text, _, cure = line.partition(". ")
    return Finding("doubtful", "warning", text.rstrip("."), cure)

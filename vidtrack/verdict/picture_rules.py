"""What was assumed about the part of the scene that a run's pictures show, compared with their background.

A file's size, its rotation or the shape of its pixels differs from the calibration's, and stage locate treats the
pictures as those of the calibration. Where stage steadiness finds the background where the calibration's clips have
it, that was right.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from vidtrack.findings import Finding

ASSUMED = frozenset(("picture-scaled", "rotation-differs", "pixel-shape-differs"))
"""Findings of assumptions that a background confirms."""

CONFIRMED_PX = 0.5
"""px rms over the picture: a part, a wide mode or a turn of the picture displaces it by many."""


def with_background(findings: Iterable[Finding], steadiness: Mapping[str, Any], where: str) -> list[Finding]:
    """Findings of a run, of which those that its background confirms are notes.

    steadiness   record of the stage: cameras, each with since_calibration {px, sd}, None where it is not known
    where        runs.<run>, with which texts of these findings begin
    """
    held = [name for name, own in (steadiness.get("cameras") or {}).items() if _held(own.get("since_calibration"))]
    return [_confirmed(finding, held, where) for finding in findings]


def _held(since: Mapping[str, float] | None) -> bool:
    return since is not None and since["px"] + 3 * since["sd"] < CONFIRMED_PX


def _confirmed(finding: Finding, held: Iterable[str], where: str) -> Finding:
    begins = tuple(f"{where}: {name}{after}" for name in held for after in (" ", "'s file "))
    if finding.code not in ASSUMED or not finding.text.startswith(begins):
        return finding
    first = finding.text.split(". ")[0].removesuffix(".")
    text = f"{first}. Its background lies where the calibration clips have it: both show the same part of the scene"
    return finding._replace(level="note", text=text, cure="")

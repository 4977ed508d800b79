"""What was assumed about the part of the scene that a run's pictures show, compared with their background.

A file's size, its rotation or the shape of its pixels differs from the calibration's, and stage locate treats the
pictures as those of the calibration. Where stage steadiness finds the background where the calibration's clips have
it, that was right. So it was for a file that is turned by its flag, where the lines of sight of the other cameras,
which are not turned, meet its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from vidtrack.findings import Finding

ASSUMED = frozenset(("picture-scaled", "picture-framed", "rotation-differs", "pixel-shape-differs"))
"""Findings of assumptions that a background confirms."""

APART = frozenset(
    (
        "sight-lines-miss",
        "cameras-disagree",
        "match-contradicted",
        "nothing-matched",
        "track-unmatched",
        "pictures-wrong",
        "targets-missing",
        "camera-seldom-measured",
    )
)
"""Findings of cameras that do not see one scene: a picture upside down makes some of them."""

CONFIRMED_PX = 0.5
"""px rms over the picture: a part, a wide mode or a turn of the picture displaces it by many."""


def with_background(findings: Iterable[Finding], steadiness: Mapping[str, Any], where: str) -> list[Finding]:
    """Findings of a run, of which those that its background confirms are notes.

    steadiness   record of the stage: cameras, each with since_calibration {px, sd}, None where it is not known
    where        runs.<run>, with which texts of these findings begin
    """
    findings = list(findings)
    turned = [finding for finding in findings if finding.code == "rotation-differs"]
    if turned and len(turned) < len(steadiness.get("cameras") or {}) and not any(f.code in APART for f in findings):
        findings = [_agreed(finding) if finding in turned else finding for finding in findings]
    held = [name for name, own in (steadiness.get("cameras") or {}).items() if _held(own.get("since_calibration"))]
    return [_confirmed(finding, held, where) for finding in findings]


def _agreed(finding: Finding) -> Finding:
    """Of a camera that is turned by its flag, where the other cameras' lines of sight meet its own."""
    first = finding.text.split(". ")[0].removesuffix(".")
    text = f"{first}. Shown as the flags say, its lines of sight meet those of the other cameras"
    return finding._replace(level="note", text=text, cure="")


def _held(since: Mapping[str, float] | None) -> bool:
    return since is not None and since["px"] + 3 * since["sd"] < CONFIRMED_PX


def _confirmed(finding: Finding, held: Iterable[str], where: str) -> Finding:
    begins = tuple(f"{where}: {name}{after}" for name in held for after in (" ", "'s file "))
    if finding.code not in ASSUMED or not finding.text.startswith(begins):
        return finding
    first = finding.text.split(". ")[0].removesuffix(".")
    text = f"{first}. Its background lies where the calibration clips have it: both show the same part of the scene"
    return finding._replace(level="note", text=text, cure="")

"""One word for a calibration or a run, with the findings that it rests on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from vidtrack.findings import LEVELS, Finding, as_records, worst_first
from vidtrack.naming import some_of

Word = Literal["good", "doubtful", "bad", "failed"]
WORDS: tuple[Word, ...] = get_args(Word)
"""In rising order. good: use the numbers; doubtful: some may be wrong, or worse than their sigma says; bad: do not use
them; failed: there are none."""


CAUSES = frozenset(
    (
        "pictures-wrong",
        "same-film",
        "losses-hidden",
        "clip-flipped",
        "clip-copied",
        "clock-far-off",
        "picture-rate-wrong",
        "camera-moved-between",
        "camera-moved-along-run",
        "rotation-differs",
        "pictures-lost",
        "pictures-repeat-in-pattern",
    )
)
"""Kinds of findings that explain others: they come first among those of their level."""

CONSEQUENCES = frozenset(
    (
        "nothing-matched",
        "match-contradicted",
        "match-ambiguous",
        "track-unmatched",
        "targets-missing",
        "samples-missing",
        "reference-target-missing",
        "reading",
        "warning",
    )
)
"""Kinds of findings that others explain, or that say no cure: they come last, as the terminal shows the first alone."""


@dataclass(frozen=True)
class Judgement:
    """A word, its reasons (doubtful or worse, worst first) and the notes, which change nothing."""

    verdict: Word
    reasons: tuple[Finding, ...]
    notes: tuple[Finding, ...]

    def as_record(self) -> dict[str, Any]:
        """As it is written to JSON."""
        return {"verdict": self.verdict, "reasons": as_records(self.reasons), "notes": as_records(self.notes)}


def judged(findings: Iterable[Finding]) -> Judgement:
    """The judgement that findings amount to: the word of the worst; good where none is more than a note.

    What two jobs say in the same words is said once. Within a level, causes come before what follows from them.
    """
    once = {(finding.level, finding.text): finding for finding in reversed(list(findings))}
    as_found = list(reversed(once.values()))
    ordered = worst_first(sorted(as_found, key=_rank))
    reasons = tuple(finding for finding in ordered if finding.level != "note")
    notes = tuple(finding for finding in ordered if finding.level == "note")
    word: Word = reasons[0].level if reasons and reasons[0].level != "note" else "good"
    return Judgement(word, reasons, notes)


def _rank(finding: Finding) -> int:
    return 0 if finding.code in CAUSES else 2 if finding.code in CONSEQUENCES else 1


def added(found: Iterable[Finding], ruled: Iterable[Finding]) -> list[Finding]:
    """Findings of the stages with those that the rules of the verdict add.

    Where a stage found a thing of the same code, as bad or worse, its words are the better ones: the rule is dropped.
    """
    found = list(found)
    worst: dict[str, int] = {}
    for finding in found:
        worst[finding.code] = max(worst.get(finding.code, 0), LEVELS.index(finding.level))
    return found + [rule for rule in ruled if LEVELS.index(rule.level) > worst.get(rule.code, -1)]


def worst_word(words: Iterable[str]) -> Word:
    """The worst of several words; good where there is none."""
    return WORDS[max((WORDS.index(word) for word in words if word in WORDS), default=0)]


def inherited(what: str, judgement: Judgement) -> list[Finding]:
    """What a doubt about a calibration means for a run that uses it: one finding, none where it is good."""
    if judgement.verdict == "good":
        return []
    first = judgement.reasons[0]
    level = "bad" if judgement.verdict == "failed" else judgement.verdict
    text = f"{what} is {judgement.verdict}: {first.text}"
    return [Finding(level, f"calibration-{judgement.verdict}", text, first.cure)]


def terminal_lines(record: Mapping[str, Any]) -> list[str]:
    """A verdict.json as lines to be read at the end of a run of the workflow: worst first, one line each."""
    entries = [("calibration", record["calibration"])] if record.get("calibration") else []
    entries += [(f"run {name}", own) for name, own in (record.get("runs") or {}).items()]
    lines = [
        f"vidtrack: {name}: {own['verdict']}{_because(own['reasons'])}"
        for name, own in sorted(entries, key=lambda entry: -WORDS.index(entry[1]["verdict"]))
    ]
    if awaited := record.get("awaited"):
        lines.append(f"vidtrack: {not_recorded(awaited)}")
    if places := record.get("outdated"):
        lines.append(f"vidtrack: {of_earlier_call(places)}")
    return lines


def not_recorded(awaited: Sequence[str]) -> str:
    """What is said of runs that the config names and that are not recorded."""
    many = len(awaited) > 1
    folders = "are no such folders" if many else "is no such folder"
    return f"run{'s' * many} {some_of(awaited)}: not recorded yet: there {folders} in runs/."


def of_earlier_call(places: Sequence[str]) -> str:
    """What is said of results that are there and do not belong to the present settings and inputs."""
    first = next((place for place in places if place.endswith("/trajectories.csv")), places[0])
    more = f" and {len(places) - 1} more files are" if len(places) > 1 else " is"
    return f"results/{first}{more} of an earlier call, not of this one: do not use them (see OUTDATED.txt there)."


def _because(reasons: list[Mapping[str, str]]) -> str:
    if not reasons:
        return ""
    first, more = reasons[0], len(reasons) - 1
    others = f" ({more} more reason{'s' if more > 1 else ''} in the report)" if more else ""
    return f": {sentence(first['text'])} {sentence(first.get('cure', ''))}".rstrip() + others


def sentence(text: str) -> str:
    """Text with a full stop at its end, where it has none."""
    return text if not text or text.endswith((".", "?", "!")) else text + "."


def capitalised(text: str) -> str:
    """Text that begins with a capital letter, as a sentence does."""
    return text[:1].upper() + text[1:]

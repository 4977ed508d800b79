"""Plain words (docs/house-style.md, "Words") in all code, rules and docs."""

import re
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]
CLEAN = ["docs", "README.md", "config.yaml", "workflow/rules", "benchmarks", "vidtrack"]
RIDDLES = re.compile(
    r"\b(nobody|everybody|somebody|anybody|himself|herself|foretells?|foretold|foretelling|lest)\b"
    r"|held against|holds? \w+ against|\btold (by|apart)\b|\bwho tells\b",
    re.IGNORECASE,
)
NOT_FOR_PROGRAMS = re.compile(
    r"\b(told|tells?|telling|witness(es)?|whoever|glances?|vouch(es)?|borne out)\b"
    r"|\bwatch(es|ed|ing)?\b(?! circle)|_told\b|\btold_",
    re.IGNORECASE,
)
"""A program estimates, reports, distinguishes or records; a method is compared with another."""
PERSONIFIED = re.compile(
    r"\b(believes?|believed (by|in)|(is|are|be|not) believed|trembl\w+|stands? about|speaks?|spoken|at odds|misled)\b"
    r"|\b(hangs? (on|together|elsewhere)|parted|worth a word|(is|are) of (none|no trajectory))\b"
    r"|\b(for want of|guesswork|(or|and) its like|knows? (no|nothing)|to speak of|quarrels?|own right)\b",
    re.IGNORECASE,
)
"""Values are used, accepted or left out; what stands still and is no target is static clutter; files and methods do not
speak, know or believe. A thing depends on another, belongs to none, is split or divided."""
DOCUMENTED_KEYS = ('"nobody"', '"witnesses"')
LISTED = ("house-style.md",)  # it lists the words that are not to be used


def texts():
    for place in CLEAN:
        path = REPO / place
        files = (
            [path] if path.is_file() else [p for p in path.rglob("*") if p.suffix in (".md", ".py", ".smk", ".html")]
        )
        yield from ((f, f.read_text()) for f in sorted(files) if f.name not in LISTED)


@pytest.mark.parametrize("path", [path for path, _ in texts()], ids=lambda p: str(p.relative_to(REPO)))
def test_sentences_use_the_fields_words(path):
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if not any(key in line for key in DOCUMENTED_KEYS):
            found = RIDDLES.search(line) or NOT_FOR_PROGRAMS.search(line) or PERSONIFIED.search(line)
            assert not found, f"{path.relative_to(REPO)}, line {number}: {line.strip()}"

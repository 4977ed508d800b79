"""Plain words (docs/house-style.md, "Words") in the rooms that were gone through; rooms are added, never removed."""

import re
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]
CLEAN = [
    "docs",
    "README.md",
    "config.yaml",
    "workflow/rules",
    "vidtrack/report",
    "vidtrack/figures",
    "vidtrack/verdict",
]
CLEAN += [f"vidtrack/{room}" for room in ("analysis", "association", "calibration", "files", "geometry", "labelling")]
CLEAN += [f"vidtrack/{room}" for room in ("location", "planning", "settings", "timing", "tracking", "workflow")]
CLEAN += ["vidtrack/stages/back_project.py", "vidtrack/stages/stability.py", "vidtrack/stages/verdict.py"]
CLEAN += ["vidtrack/motion", "vidtrack/shore"]
CLEAN += ["vidtrack/stages/bodies.py", "vidtrack/stages/waterline.py", "vidtrack/findings.py", "vidtrack/results.py"]
RIDDLES = re.compile(
    r"\b(nobody|everybody|somebody|anybody|himself|herself|foretells?|foretold|foretelling|lest)\b"
    r"|held against|holds? \w+ against|\btold (by|apart)\b|\bwho tells\b",
    re.IGNORECASE,
)
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
        if '"nobody"' not in line:  # the value that locate.json has had for the source of a clock
            assert not RIDDLES.search(line), f"{path.relative_to(REPO)}, line {number}: {line.strip()}"

"""Every explanation belongs to a table, and every table of the page that holds numbers has one."""

import re
from pathlib import Path

from vidtrack import report
from vidtrack.report.explanations import ABOUT

SOURCES = [p.read_text() for p in Path(report.__file__).parent.glob("*.py") if p.name != "explanations.py"]


def test_every_explanation_is_used_and_every_used_one_exists():
    assert {key for text in SOURCES for key in re.findall(r'ABOUT\["([\w-]+)"\]', text)} == set(ABOUT)


def test_an_explanation_is_a_few_sentences():
    for key, text in ABOUT.items():
        assert text.endswith("."), key
        assert 60 < len(text) < 450, key

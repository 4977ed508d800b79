"""A check for known vulnerabilities that could ask for nothing has not passed."""

import importlib.util
import json
from pathlib import Path

import pytest

REPO = Path(__file__).parents[1]
GOOD = {"name": "one", "version": "1.0", "vulns": []}
BAD = {"name": "two", "version": "2.0", "vulns": [{"id": "PYSEC-1"}]}
SKIPPED = {"name": "three", "skip_reason": "Dependency not found on PyPI and could not be audited: three (3.0)"}


@pytest.fixture(scope="module")
def audit():
    spec = importlib.util.spec_from_file_location("audit", REPO / ".ci/audit.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("packages", "code", "said"),
    [
        ([GOOD], "CHECKED", "1 of 1 packages asked for, 0 known"),
        ([GOOD, BAD, SKIPPED], "VULNERABLE", "two 2.0: PYSEC-1"),
        ([GOOD, SKIPPED], "IN_PART", "1 of 2 packages asked for"),
        ([SKIPPED], "NOT_AT_ALL", "knows none of them"),
        ([], "NOT_AT_ALL", "knows none of them"),
    ],
)
def test_only_what_was_asked_for_was_checked(audit, tmp_path, packages, code, said):
    answer = tmp_path / "audit.json"
    answer.write_text(json.dumps({"dependencies": packages, "fixes": []}))
    assert audit.outcome(answer)[0] == getattr(audit, code)
    assert said in audit.outcome(answer)[1]


@pytest.mark.parametrize("text", [None, "", "[]", '{"dependencies": [1]}'])
def test_an_answer_that_is_none_checks_nothing(audit, tmp_path, text):
    if text is not None:
        (tmp_path / "audit.json").write_text(text)
    assert audit.outcome(tmp_path / "audit.json")[0] == audit.NOT_AT_ALL

"""What became of a job that failed is written, read and forgotten."""

import json
import os
from pathlib import Path

import pytest

from vidtrack.workflow.failure import failure_place, remove_failure, write_failure

ACCOUNT = "lab/results/.provenance/track/pluck/cam1.json"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_failure_lies_beside_the_accounts_under_the_same_name():
    assert failure_place(ACCOUNT) == os.path.join("lab/results", ".failures", "track/pluck/cam1.json")


def test_the_record_says_rule_parts_and_every_problem():
    path = write_failure(ACCOUNT, "track", ["no frames. Copy the file again.", "zweite Ärgernis"])
    record = json.loads(Path(path).read_text("utf-8"))
    assert record["rule"] == "track"
    assert record["parts"] == ["pluck", "cam1"]
    assert [f["level"] for f in record["findings"]] == ["failed", "failed"]
    assert record["findings"][0]["text"] == "no frames. Copy the file again."
    assert record["findings"][1]["text"] == "zweite Ärgernis"


def test_the_code_of_a_failure_is_its_rule_s_name_as_codes_are_written():
    path = write_failure("results/.provenance/back_project/job.json", "back_project", ["x"])
    record = json.loads(Path(path).read_text())
    assert record["findings"][0]["code"] == "back-project-failed"


def test_a_failure_that_is_forgotten_leaves_no_empty_folder_and_others_stay():
    other = "lab/results/.provenance/track/forced/cam1.json"
    write_failure(ACCOUNT, "track", ["x"])
    write_failure(other, "track", ["y"])
    remove_failure(ACCOUNT)
    assert os.listdir("lab/results/.failures/track") == ["forced"]
    remove_failure(other)
    assert os.listdir("lab/results") == []
    remove_failure(other)  # nothing there: nothing done

"""From a mishap in a job to one line, a log and an exit code."""

import errno
import json
import sys
from types import SimpleNamespace

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.workflow.entry import main


@pytest.fixture
def call(tmp_path, monkeypatch):
    """A call of a job that does what it is told to; the exit code."""
    (tmp_path / "order.json").write_text(json.dumps({"settings": {"units": "in"}, "inputs": {"raw.csv": "f00"}}))
    (tmp_path / "made.parquet").write_bytes(b"made by an earlier rule")

    def called(job):
        monkeypatch.setitem(sys.modules, "vidtrack.jobs.pretended", SimpleNamespace(run=job))
        rest = ["--input", "raw", "raw.csv", "--input", "made", str(tmp_path / "made.parquet"), "--input", "none"]
        rest += ["--output", "table", str(tmp_path / "out.parquet"), "--log", str(tmp_path / "logs/job.log")]
        return main(["pretended", "--settings", str(tmp_path / "order.json"), *rest])

    return called


def raising(error):
    def job(_):
        raise error

    return job


def test_a_job_gets_its_settings_paths_and_checksums(call, tmp_path):
    jobs = []
    assert call(jobs.append) == 0
    (job,) = jobs
    assert job.settings == {"units": "in"}
    assert (job.path("raw"), job.paths("none")) == ("raw.csv", [])
    assert job.provenance["inputs"]["raw.csv"] == "f00"
    assert len(job.provenance["inputs"][str(tmp_path / "made.parquet")]) == 64


def test_every_problem_is_a_line_in_the_log_too_which_goes_when_all_is_well(call, tmp_path, capsys):
    assert call(raising(VidtrackError("one.", "two."))) == 1
    assert capsys.readouterr().err == "vidtrack: one.\nvidtrack: two.\n"
    assert (tmp_path / "logs/job.log").read_text() == "vidtrack: one.\nvidtrack: two.\n"
    assert call(lambda job: None) == 0
    assert not (tmp_path / "logs/job.log").exists()


def test_a_full_disk_is_told_by_what_could_not_be_written(call, capsys):
    assert call(raising(OSError(errno.ENOSPC, "No space left on device"))) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("out.parquet: No space left on device. Mend it and run again.")
    assert call(raising(PermissionError(errno.EACCES, "Permission denied", "clip.mov"))) == 1
    assert capsys.readouterr().err == "vidtrack: clip.mov: Permission denied. Mend it and run again.\n"


def test_ctrl_c_ends_a_job_without_a_word(call, capsys):
    assert call(raising(KeyboardInterrupt())) == 130
    assert capsys.readouterr().err == ""

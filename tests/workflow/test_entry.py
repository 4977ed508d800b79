"""From an error in a job to one line, a log and an exit code; from a job that ends well to its account."""

import errno
import hashlib
import io
import json
import os
import sys
from types import SimpleNamespace

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import replacing
from vidtrack.workflow.entry import main
from vidtrack.workflow.provenance import Order, read_account

RAW = b"made by a person"
ORDERED = hashlib.sha256(RAW).hexdigest()
ORDER = Order('{"units":"in"}', f'{{"runs/pluck/raw.csv":"{ORDERED}"}}', '{"code":"abc"}')


@pytest.fixture
def call(tmp_path, monkeypatch):
    """A call of a job that does what it is asked to, in an experiment's folder; the exit code."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results/made.parquet").write_bytes(b"made by an earlier rule")
    raw_file(tmp_path, RAW)

    def called(job, log="results/logs/job.log", order=ORDER):
        monkeypatch.setitem(sys.modules, "vidtrack.jobs.pretended", SimpleNamespace(run=job))
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in order)))
        rest = ["--input", "raw", "runs/pluck/raw.csv", "--input", "made", "results/made.parquet", "--input", "none"]
        rest += ["--output", "table", "results/out.parquet", "--log", log]
        return main(["pretended", "--account", "results/.provenance/pretended/pluck.json", *rest])

    return called


def writing(job):
    with replacing(job.outputs["table"]) as file:
        file.write(b"numbers")


def raising(error):
    def job(_):
        raise error

    return job


def test_a_job_gets_its_settings_paths_and_checksums(call):
    jobs = []

    def job(asked):
        jobs.append(asked)
        writing(asked)

    assert call(job) == 0
    (job,) = jobs
    assert job.settings == {"units": "in"}
    assert (job.path("raw"), job.paths("none")) == ("runs/pluck/raw.csv", [])
    assert job.provenance["inputs"]["runs/pluck/raw.csv"] == ORDERED
    assert len(job.provenance["inputs"]["results/made.parquet"]) == 64


def test_provenance_tells_the_code_and_the_libraries(call):
    jobs = []
    call(lambda job: (jobs.append(job), writing(job)))
    provenance = jobs[0].provenance
    assert provenance["code"] == "abc"
    assert set(provenance["libraries"]) == {"av", "cv2", "numpy", "scipy"}
    assert provenance["libraries"]["numpy"].count(".") == 2


def test_a_job_that_ends_well_writes_its_account_last(call):
    def job(asked):
        assert read_account("results/.provenance/pretended/pluck.json") is None
        writing(asked)

    assert call(job) == 0
    account = read_account("results/.provenance/pretended/pluck.json")
    assert account.order == ORDER
    assert list(account.used) == ["results/made.parquet"]
    assert list(account.made) == ["results/out.parquet"]


def test_every_problem_is_a_line_in_the_log_too_which_goes_when_all_is_well(call, tmp_path, capsys):
    assert call(raising(VidtrackError("one.", "two."))) == 1
    assert capsys.readouterr().err == "vidtrack: one.\nvidtrack: two.\n"
    assert (tmp_path / "results/logs/job.log").read_text() == "vidtrack: one.\nvidtrack: two.\n"
    assert not (tmp_path / "results/.provenance").exists()
    assert call(writing) == 0
    assert not (tmp_path / "results/logs/job.log").exists()


def test_a_failure_is_recorded_as_a_finding_until_the_job_is_tried_again(call, tmp_path):
    call(raising(VidtrackError("no ball to be seen.")))
    record = json.loads((tmp_path / "results/.failures/pretended/pluck.json").read_text())
    assert (record["rule"], record["parts"]) == ("pretended", ["pluck"])
    assert record["findings"] == [
        {"level": "failed", "code": "pretended-failed", "text": "no ball to be seen.", "cure": ""}
    ]
    assert call(writing) == 0
    assert not any((tmp_path / "results/.failures").glob("*"))


def test_an_unexpected_error_is_one_line_on_the_terminal_and_a_traceback_in_the_log(call, tmp_path, capsys):
    assert call(raising(RuntimeError("three is\nno colour"))) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("vidtrack: pretended: unexpected RuntimeError: three is no colour. ")
    assert "results/logs/job.log" in line
    log = (tmp_path / "results/logs/job.log").read_text()
    assert log.startswith(line)
    assert "Traceback (most recent call last)" in log


def test_a_full_disk_is_told_by_what_could_not_be_written(call, capsys):
    assert call(raising(OSError(errno.ENOSPC, "No space left on device"))) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("No space left on device. Free some space and run again.")
    assert call(raising(PermissionError(errno.EACCES, "Permission denied", "clip.mov"))) == 1
    assert capsys.readouterr().err == "vidtrack: clip.mov: Permission denied. Correct its permissions and run again.\n"


def test_a_log_that_cannot_be_written_hides_no_problem(call, tmp_path, capsys):
    (tmp_path / "results/logs").write_text("a file where a folder should be")
    assert call(raising(VidtrackError("one."))) == 1
    first, second = capsys.readouterr().err.splitlines()
    assert first == "vidtrack: one."
    assert "cannot be written" in second


def test_what_hinders_the_log_as_it_hindered_the_job_is_said_once(call, tmp_path, capsys, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("vidtrack.workflow.entry.write_failure", full)
    assert call(raising(OSError(errno.ENOSPC, "No space left on device"))) == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_log_that_would_overwrite_another_file_leaves_it_and_hides_no_problem(call, tmp_path, capsys):
    (tmp_path / "points.csv").write_text("tag,x,y,z")
    assert call(writing, log="points.csv") == 0
    assert call(raising(VidtrackError("no ball. Light it.")), log="points.csv") == 1
    assert (tmp_path / "points.csv").read_text() == "tag,x,y,z"
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "vidtrack: no ball. Light it."
    assert said[1].startswith("vidtrack: points.csv: cannot be written (a file that is no log is there).")


def raw_file(tmp_path, content):
    (tmp_path / "runs/pluck").mkdir(parents=True, exist_ok=True)
    path = tmp_path / "runs/pluck/raw.csv"
    path.with_suffix(".new").write_bytes(content)
    os.replace(path.with_suffix(".new"), path)
    return hashlib.sha256(content).hexdigest()


def test_a_recording_that_is_replaced_while_it_is_read_fails_its_job_even_if_it_is_put_back(call, tmp_path, capsys):
    ordered = ORDER._replace(files=json.dumps({"runs/pluck/raw.csv": raw_file(tmp_path, b"one")}))

    def meanwhile(job):
        raw_file(tmp_path, b"two")
        writing(job)
        raw_file(tmp_path, b"one")

    assert call(meanwhile, order=ordered) == 1
    assert capsys.readouterr().err == "vidtrack: runs/pluck/raw.csv: changed while it was read. Run again.\n"
    assert not (tmp_path / "results/.provenance/pretended/pluck.json").exists()
    assert call(writing, order=ordered) == 0


def test_a_recording_that_is_not_the_one_that_was_ordered_is_not_read(call, tmp_path, capsys):
    ordered = ORDER._replace(files=json.dumps({"runs/pluck/raw.csv": raw_file(tmp_path, b"one")}))
    raw_file(tmp_path, b"two")
    jobs = []
    assert call(jobs.append, order=ordered) == 1
    assert not jobs
    assert "runs/pluck/raw.csv: is another file than when this run was planned" in capsys.readouterr().err


def test_a_job_of_results_alone_reads_nothing_of_what_is_remembered(call, monkeypatch):
    monkeypatch.setattr("vidtrack.workflow.entry.Checksums", lambda store: pytest.fail(f"{store} was read"))
    assert call(writing, order=ORDER._replace(files="{}")) == 0


def test_a_file_that_was_ordered_and_is_gone_is_not_done_without(call, tmp_path, capsys):
    """Optional ones too, such as picks: the account would say that they were used."""
    ordered = ORDER._replace(files=json.dumps({"runs/pluck/raw.csv": raw_file(tmp_path, b"one")}))
    os.unlink(tmp_path / "runs/pluck/raw.csv")
    assert call(writing, order=ordered) == 1
    assert "runs/pluck/raw.csv: is gone since this run was planned" in capsys.readouterr().err
    assert not (tmp_path / "results/.provenance/pretended/pluck.json").exists()


def test_a_log_of_which_a_full_disk_left_the_beginning_is_written_again(call, tmp_path, capsys):
    (tmp_path / "results/logs").mkdir()
    (tmp_path / "results/logs/job.log").write_text("vid")
    assert call(raising(VidtrackError("one."))) == 1
    assert capsys.readouterr().err == "vidtrack: one.\n"
    assert (tmp_path / "results/logs/job.log").read_text() == "vidtrack: one.\n"


def test_a_device_as_a_log_stays(call, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert call(writing, log=str(tmp_path / "pipe")) == 0
    assert (tmp_path / "pipe").is_fifo()
    assert call(raising(VidtrackError("one.")), log=os.devnull) == 1
    assert os.path.exists(os.devnull)


def test_what_a_killed_job_left_unfinished_is_removed(call, tmp_path):
    half = tmp_path / "results/.out.parquet.ab_12cd3.partial"
    another = tmp_path / "results/.out.parquet.x.ab12cd34.partial"
    half.write_bytes(b"numb")
    another.write_bytes(b"of a job that runs")
    assert call(writing) == 0
    assert not half.exists()
    assert another.exists()


def test_no_order_on_the_input_is_told(call, capsys):
    assert call(writing, order=()) == 1
    assert "no order on the standard input" in capsys.readouterr().err


def test_ctrl_c_ends_a_job_without_a_word(call, capsys):
    assert call(raising(KeyboardInterrupt())) == 130
    assert capsys.readouterr().err == ""

import errno
import os

import pytest

from vidtrack.workflow.small_jobs import SERVER
from vidtrack.workflow.speaker import Speaker, refused


@pytest.fixture
def a_call_of_snakemake(tmp_path, monkeypatch):
    folder = tmp_path / "server"
    folder.mkdir()
    monkeypatch.setenv(SERVER, f"{folder / 'jobs'}\n1\npython")
    return folder


def full(path):
    return OSError(errno.ENOSPC, "No space left on device", path)


def test_two_jobs_of_one_call_say_the_same_line_once(a_call_of_snakemake, capsys):
    Speaker().say(["cam1.mov: is another file. Run again."])
    Speaker().say(["cam1.mov: is another file. Run again.", "cam2.mov: is empty."])
    said = capsys.readouterr().err.splitlines()
    assert said == ["vidtrack: cam1.mov: is another file. Run again.", "vidtrack: cam2.mov: is empty."]


def test_without_a_call_of_snakemake_each_job_says_its_own_lines(monkeypatch, capsys):
    monkeypatch.delenv(SERVER, raising=False)
    for _ in range(2):
        Speaker().say(["one.", "one."])
    assert capsys.readouterr().err == "vidtrack: one.\n" * 2


def test_a_full_disk_is_one_line_whatever_could_not_be_written(a_call_of_snakemake, tmp_path, capsys):
    Speaker().say_refused(full(str(tmp_path / "results/a.parquet")), "results")
    speaker = Speaker()
    speaker.say_refused(OSError(errno.ENOSPC, "No space left on device"), str(tmp_path / "results/runs"))
    speaker.say_refused(full(str(tmp_path / "results/logs/b.log")), "the log")
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"vidtrack: {tmp_path}/results/a.parquet: No space left on device. Free some space and run again."


def test_two_files_that_may_not_be_read_are_two_lines(a_call_of_snakemake, capsys):
    for name in ("a.csv", "b.csv", "a.csv"):
        Speaker().say_refused(PermissionError(errno.EACCES, "Permission denied", name), "results")
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_a_line_is_said_where_the_folder_of_notes_is_gone(a_call_of_snakemake, capsys):
    os.rmdir(a_call_of_snakemake)
    Speaker().say(["one."])
    assert capsys.readouterr().err == "vidtrack: one.\n"


@pytest.mark.parametrize(
    ("path", "place"),
    [("results/.a.parquet.x1y2z3w4.partial", "results/a.parquet"), ("results/a.parquet", "results/a.parquet")],
)
def test_the_file_is_named_that_was_to_be_written_and_not_the_unfinished_one(path, place):
    assert refused(full(path), "").startswith(f"{place}: No space left")

import io
import json
import os
import re

import pytest
from rich.console import Console

from vidtrack.progress import ANNOUNCED, Progress, announce, announce_end
from vidtrack.running.display import Display, Steps, jobs_at_work, time_left


def test_the_number_of_jobs_is_read_without_the_rule_that_does_nothing():
    steps = Steps()
    for line in ("job      count", "track        4", "total       19", "3 of 19 steps (16%) done"):
        steps = steps.after(line)
    assert steps == Steps(3, 18)
    assert steps.after("19 of 19 steps (100%) done") == Steps(18, 18)
    assert steps.after("a video of 3 of 19 balls") == steps


def test_a_job_that_announces_itself_is_seen_until_it_ends(tmp_path, monkeypatch):
    monkeypatch.setenv(ANNOUNCED, str(tmp_path))
    announce("track pluck/cam1", 30, 120, "frames", 2.0)
    (job,) = jobs_at_work(str(tmp_path))
    assert (job["job"], time_left(job)) == ("track pluck/cam1", 6.0)
    announce_end()
    assert jobs_at_work(str(tmp_path)) == []


def test_a_job_that_was_killed_is_no_longer_shown(tmp_path):
    (tmp_path / "999999999.json").write_text(json.dumps({"job": "x", "done": 1, "total": 2, "unit": "", "elapsed": 1}))
    assert jobs_at_work(str(tmp_path)) == []


def test_progress_is_announced_without_a_terminal(tmp_path, monkeypatch):
    monkeypatch.setenv(ANNOUNCED, str(tmp_path))
    clock = iter([0.0, 1.0, 2.0])
    monkeypatch.setattr("vidtrack.progress.time.monotonic", lambda: next(clock))
    progress = Progress("track a/b", 10, "frames", io.StringIO())
    progress.advance(4)
    record = json.loads((tmp_path / f"{os.getpid()}.json").read_text())
    assert record == {"job": "track a/b", "done": 4, "total": 10, "unit": "frames", "elapsed": 1.0}


@pytest.mark.parametrize("folder", [None, "/nowhere/at/all"])
def test_a_place_that_cannot_be_written_stops_no_work(monkeypatch, folder):
    monkeypatch.setenv(ANNOUNCED, folder) if folder else monkeypatch.delenv(ANNOUNCED, raising=False)
    announce("x")
    announce_end()


def test_the_display_shows_job_frames_rate_and_time_left(tmp_path, monkeypatch):
    monkeypatch.setenv(ANNOUNCED, str(tmp_path))
    announce("track pluck/cam1", 300, 900, "frames", 3.0)
    out = io.StringIO()
    with Display(Console(file=out, force_terminal=True, width=120), str(tmp_path)) as display:
        display.heard("5 of 11 steps (45%) done")
        display.refresh()
    text = out.getvalue()
    for part in ("5 of 10 jobs done", "track pluck/cam1", "300 of 900 frames", "100/s", "0:06 left"):
        assert part in text


def test_a_line_of_80_columns_holds_the_longest_job(tmp_path, monkeypatch):
    monkeypatch.setenv(ANNOUNCED, str(tmp_path))
    announce("calibration_points rear-left-of-the-tank/camera-3", 99_000, 100_000, "frames", 400.0)
    out = io.StringIO()
    with Display(Console(file=out, force_terminal=True, width=80), str(tmp_path)) as display:
        display.heard("5 of 11 steps (45%) done")
        display.refresh()
    (line,) = {line for line in re.split(r"[\r\n]|\x1b\[\w*", out.getvalue()) if "camera-3" in line}
    assert len(line) <= 80
    assert "99000 of 100000 frames" in line
    assert line.rstrip().endswith("0:04 left")


def test_while_nothing_is_counted_the_display_says_what_is_done_and_for_how_long(tmp_path, monkeypatch):
    monkeypatch.setenv(ANNOUNCED, str(tmp_path))
    announce("track pluck/cam1", phase="reading its time code")
    out = io.StringIO()
    with Display(Console(file=out, force_terminal=True, width=80), str(tmp_path)) as display:
        display.refresh()
        assert "planning" in out.getvalue()
        assert "reading its time code" in out.getvalue()
        assert "for 0:00" in out.getvalue()
        announce_end()
        display.heard("1 of 11 steps (9%) done")
        display.refresh()
    assert "the next jobs are being started" in out.getvalue()


@pytest.mark.parametrize(
    "terminal", [{"force_terminal": False}, {"force_terminal": True, "_environ": {"TERM": "dumb"}}]
)
def test_without_a_terminal_that_can_be_redrawn_each_job_done_is_a_line(tmp_path, terminal):
    out = io.StringIO()
    with Display(Console(file=out, **terminal), str(tmp_path)) as display:
        display.heard("1 of 3 steps (33%) done")
        display.heard("rule x:")
        display.heard("2 of 3 steps (67%) done")
    assert out.getvalue().splitlines() == ["vidtrack: 1 of 2 jobs done", "vidtrack: 2 of 2 jobs done"]


def test_after_ctrl_c_the_display_says_that_it_stops_and_not_that_jobs_begin(tmp_path):
    out = io.StringIO()
    with Display(Console(file=out, force_terminal=True, width=80), str(tmp_path), lambda: True) as display:
        display.heard("1 of 11 steps (9%) done")
        display.refresh()
    assert "stopping: 1 of 10 jobs done" in out.getvalue()
    assert "being started" not in out.getvalue()

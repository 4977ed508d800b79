"""A small experiment folder on paper: no real video, for what is decided before any is opened."""

import os

import hypothesis
import pytest

if hypothesis.settings.default.deadline is not None:  # a busy machine is no fault of the code
    hypothesis.settings.register_profile("untimed", deadline=None)
    hypothesis.settings.load_profile("untimed")


@pytest.fixture(autouse=True)
def ordinary_priority():
    """No test may leave its process with real-time priority: what it starts later, a browser, would starve all else."""
    before = os.sched_getscheduler(0)
    yield
    if (after := os.sched_getscheduler(0)) != before:
        os.sched_setscheduler(0, before, os.sched_param(0))
        pytest.fail(f"the test left its process in scheduling class {after}; see tests/files/clips.same_priority")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path, text in {
        "calibration/points.csv": "tag,x,y,z\n" + "".join(f"{n},{n},0,0\n" for n in range(1, 9)),
        "calibration/row1/cam1.mov": "video",
        "calibration/row1/cam2.mov": "video",
        "calibration/row1/picks.csv": "camera,tag,Xf,Yf\ncam1,1,10,20\n",
        "runs/pluck/cam1.mov": "video",
        "runs/pluck/cam2.MP4": "video",
        "runs/pluck/reference.csv": "time_s,x_in\n0,1\n",
        "runs/pluck/notes.txt": "a windy day",
    }.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    return tmp_path

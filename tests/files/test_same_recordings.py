"""A recording that lies under two names is refused, unless nothing else can be meant."""

import shutil
from pathlib import Path

import pytest

from tests.files.folders import problems, settings
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.files.same_recordings import LEAST_BYTES

CAM1, CAM2 = "runs/pluck/cam1.mov", "runs/pluck/cam2.MP4"


def film(path, seed, n=200_000):
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_bytes(bytes((k * seed) % 251 for k in range(n)))


@pytest.fixture
def films(folder):
    film(CAM1, 3)
    film(CAM2, 5)
    assert checked_experiment(settings())
    return folder


def test_one_recording_under_the_names_of_two_cameras_is_refused(films):
    shutil.copy(CAM1, CAM2)
    (said,) = problems()
    assert said.startswith("runs/pluck: the recordings of cam1 and cam2 are the same, byte by byte")


def test_links_to_one_file_are_the_same_without_being_read(films, monkeypatch):
    monkeypatch.setattr("filecmp.cmp", lambda *_, **__: pytest.fail("was read"))
    Path(CAM2).unlink()
    Path(CAM2).hardlink_to(CAM1)
    (said,) = problems()
    assert said.startswith("runs/pluck: the recordings of cam1 and cam2 are the same, byte by byte")


def test_what_differs_in_its_middle_alone_is_another(films):
    shutil.copy(CAM1, CAM2)
    with open(CAM2, "r+b") as own:
        own.seek(100_000)
        own.write(b"\xff\xff")
    assert checked_experiment(settings())


def test_a_file_too_short_for_a_recording_two_views_by_mirrors_and_two_streams_of_a_file_are_none(films):
    film(CAM1, 3, LEAST_BYTES - 1)
    shutil.copy(CAM1, CAM2)
    assert checked_experiment(settings())
    film(CAM1, 3)
    shutil.copy(CAM1, CAM2)
    assert checked_experiment(settings(runs={"pluck": {"stream": {"cam1": 1, "cam2": 2}}}))
    clips = [p for p in Path("calibration").glob("*/*") if p.stem in ("cam1", "cam2")]
    assert clips
    for clip in clips:
        film(clip, 7)
    assert checked_experiment(settings())


def test_the_recording_of_another_run_is_refused_but_not_a_whole_run_once_more(films):
    film("runs/again/cam1.MP4", 11)
    shutil.copy(CAM2, "runs/again/cam2.MP4")
    assert "the recording of cam2 is that of run again, byte by byte" in problems()[0]
    shutil.copy(CAM1, "runs/again/cam1.MP4")
    assert checked_experiment(settings())
    film("runs/again/cam1.MP4", 11)
    film("runs/again/cam2.MP4", 13)
    assert checked_experiment(settings())
    shutil.copy(CAM1, "runs/again/cam2.MP4")
    assert "the recording of cam1 is that of cam2 in run again" in problems()[0]

"""Which results are of an earlier call, and what is written about them."""

import hashlib
from pathlib import Path

import pytest

from vidtrack.files.outdated_note import NAME
from vidtrack.files.records import read_json
from vidtrack.workflow.order_book import OrderBook
from vidtrack.workflow.outdated import forget, note, outdated, record
from vidtrack.workflow.provenance import Account, write_account

LOCATED, MOVED, VERDICT = "results/runs/a/trajectories.parquet", "results/runs/a/kinematics.parquet", "results/v.json"


def made(book, rule, parts, outputs, used=()):
    """What a job leaves that ended well."""
    sums = {}
    for name in outputs:
        path = Path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"of {book.order(rule, *parts).settings}")
        sums[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    write_account(book.place(rule, *parts), Account(book.order(rule, *parts), dict(used), sums))
    return sums


def a_book(scale=1, kinematics=True):
    book = OrderBook(".", cache=".cache")
    book.add("locate", {"scale": scale}, [], "a")
    if kinematics:
        book.add("kinematics", {}, [], "a")
    book.add("verdict", {}, [])
    return book


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    book = a_book()
    used = made(book, "locate", ("a",), [LOCATED])
    made(book, "kinematics", ("a",), [MOVED], used)
    made(book, "verdict", (), [VERDICT], used)
    return tmp_path


def test_nothing_is_outdated_where_all_is_as_it_should_be(folder):
    assert outdated(a_book()) == []


def test_what_a_changed_setting_made_and_what_follows_from_it_is_outdated_and_comes_back_with_it(folder):
    found = ["runs/a/kinematics.parquet", "runs/a/trajectories.parquet"]
    assert outdated(a_book(scale=2)) == found
    assert outdated(a_book(scale=1)) == []
    Path(LOCATED).unlink()
    assert outdated(a_book(scale=2)) == found[:1]


def test_what_no_job_makes_any_more_is_outdated_once_what_it_was_made_of_has_changed(folder):
    assert outdated(a_book(kinematics=False)) == []
    changed = a_book(scale=2, kinematics=False)
    made(changed, "locate", ("a",), [LOCATED])
    changed.look_again()
    assert outdated(changed) == ["runs/a/kinematics.parquet"]


def test_the_note_goes_when_its_results_are_as_they_should_be(folder):
    for name in ("calibration/cam1/camera.json", "report_one_file.html"):
        Path("results", name).parent.mkdir(parents=True, exist_ok=True)
        Path("results", name).write_text("x")
    note("results", ["calibration/cam1/camera.json", "report_one_file.html", "runs/a/trajectories.parquet"])
    places = [Path("results", part, NAME) for part in ("", "calibration", "runs/a")]
    assert [path.read_text().splitlines()[-1] for path in places] == [
        "report_one_file.html",
        "calibration/cam1/camera.json",
        "runs/a/trajectories.parquet",
    ]
    note("results", ["runs/a/trajectories.parquet"])
    assert [path.exists() for path in places] == [False, False, True]
    note("results", [])
    assert not any(path.exists() for path in places)


def test_the_record_is_what_the_verdict_reads_and_goes_with_the_next_call(folder):
    (path,) = record("results", ["runs/a/trajectories.parquet"])
    assert read_json(path)["outdated"] == ["runs/a/trajectories.parquet"]
    forget("results")
    assert not Path("results/.failures").exists()
    assert record("results", []) == []
    forget("results")

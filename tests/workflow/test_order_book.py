"""Orders by content, and which results are of just that order, whatever their dates and wherever the folder lies."""

import json
import os
import shutil

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.workflow.order_book import OrderBook
from vidtrack.workflow.provenance import Account, write_account


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An experiment of one reference; job `compare` reads what job `locate` makes."""
    lab = tmp_path / "lab"
    (lab / "runs/pluck").mkdir(parents=True)
    (lab / "runs/pluck/reference.csv").write_text("time_s,x_in\n0,1\n")
    (lab / "results").mkdir()
    for name in ("trajectories", "comparison"):
        (lab / f"results/{name}.json").write_text(name)
    monkeypatch.chdir(lab)
    return lab


def book(axis="x", where=".", **more):
    asked = OrderBook(where, cache=os.path.join(where, ".cache"))
    asked.add("locate", {"run": "pluck", **more}, [], "pluck")
    asked.add("compare", {"axis": axis}, [os.path.join(where, "runs/pluck/reference.csv"), None], "pluck")
    return asked


def ended(asked):
    """Every job of the book has run."""
    paths = {"locate": "results/trajectories.json", "compare": "results/comparison.json"}
    sums = {rule: asked._checksums.of(os.path.join(asked.folder, path)) for rule, path in paths.items()}
    for rule, used in (("locate", {}), ("compare", {paths["locate"]: sums["locate"]})):
        order = asked.order(rule, "pluck")
        write_account(asked.place(rule, "pluck"), Account(order, used, {paths[rule]: sums[rule]}))


def done(asked):
    return sorted(key[0] for key in asked.done)


@pytest.mark.slow
def test_jobs_that_ran_are_done_and_their_results_settled(folder):
    assert done(book()) == []
    ended(book())
    assert done(book()) == ["compare", "locate"]
    assert "results/comparison.json" in book().settled
    assert book().unsettled() == {}


def test_the_order_of_keys_says_nothing(folder):
    one, other = OrderBook(".", cache=".cache"), OrderBook(".", cache=".cache")
    one.add("locate", {"a": 1.0, "b": {"c": 2, "d": 3}})
    other.add("locate", {"b": {"d": 3, "c": 2}, "a": 1.0})
    assert one.order("locate") == other.order("locate")


@pytest.mark.slow
def test_another_setting_leaves_the_job_to_do_and_what_follows_unsettled(folder):
    ended(book())
    assert done(book(axis="y")) == ["locate"]
    assert done(book(tolerance=2.0)) == ["compare"]
    assert book(tolerance=2.0).settled == set()


@pytest.mark.slow
def test_an_edited_reference_counts_and_a_touched_one_does_not(folder):
    ended(book())
    os.utime("runs/pluck/reference.csv", (5, 5))
    assert done(book()) == ["compare", "locate"]
    with open("runs/pluck/reference.csv", "a") as file:
        file.write("1,2\n")
    assert done(book()) == ["locate"]


def test_a_file_written_over_within_the_same_size_and_date_counts(folder):
    asked = book()
    ended(asked)
    asked.save()
    before = os.stat("runs/pluck/reference.csv")
    (folder / "runs/pluck/reference.csv").write_text("time_s,x_in\n0,9\n")
    os.utime("runs/pluck/reference.csv", ns=(before.st_atime_ns, before.st_mtime_ns))
    assert done(book()) == ["locate"]


@pytest.mark.slow
def test_an_altered_lost_or_damaged_file_leaves_its_job_to_do(folder):
    ended(book())
    (folder / "results/comparison.json").write_text("altered")
    assert done(book()) == ["locate"]
    (folder / "results/comparison.json").unlink()
    assert done(book()) == ["locate"]
    for content in ("{", "[]", '{"settings": 3, "files": 1, "code": "", "used": 7, "made": []}', "\x00", "[" * 100_000):
        (folder / "results/.provenance/locate/pluck.json").write_text(content)
        assert done(book()) == []


def test_an_account_with_a_name_that_no_file_can_have_leaves_its_job_to_do(folder):
    ended(book())
    path = folder / "results/.provenance/locate/pluck.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"made": {**record["made"], "results/a\0b": "x"}}))
    assert "locate" not in done(book())


def test_results_made_of_earlier_ones_are_not_done(folder):
    """As after a call that was stopped between two rules: locate has run again, compare has not."""
    ended(book())
    (folder / "results/trajectories.json").write_text("located anew")
    asked = book()
    made = {"results/trajectories.json": asked._checksums.of("results/trajectories.json")}
    write_account(asked.place("locate", "pluck"), Account(asked.order("locate", "pluck"), {}, made))
    assert done(book()) == ["locate"]


@pytest.mark.slow
def test_a_folder_that_was_moved_or_is_spelled_otherwise_is_the_same(folder, tmp_path, monkeypatch):
    ended(book())
    assert done(book(where=str(folder))) == ["compare", "locate"]
    shutil.move(folder, tmp_path / "another")
    monkeypatch.chdir(tmp_path)
    assert done(book(where="another")) == ["compare", "locate"]


def test_a_recording_that_lies_elsewhere_is_known_by_its_name(folder, tmp_path):
    (tmp_path / "shelf").mkdir()
    (tmp_path / "shelf/cam.csv").write_text("a")
    (tmp_path / "shelf/other").mkdir()
    (tmp_path / "shelf/other/cam.csv").write_text("b")
    asked = OrderBook(".", cache=".cache")
    asked.add("clocks", {}, [str(tmp_path / "shelf/cam.csv"), str(tmp_path / "shelf/other/cam.csv")])
    assert str(tmp_path) not in asked.order("clocks").files
    assert asked.order("clocks").files.count(":") == 2


def test_runs_and_cameras_with_dots_have_places_of_their_own(folder):
    asked = book()
    assert asked.place("track", "pluck.top", "left") != asked.place("track", "pluck", "top.left")


def test_nothing_is_written_until_the_cache_is_saved(folder):
    before = sorted(folder.rglob("*"))
    asked = book()
    asked.check()
    _ = asked.settled
    assert sorted(folder.rglob("*")) == before
    asked.save()
    assert (folder / ".cache/checksums.json").exists()


def test_an_input_that_cannot_be_read_is_told_by_name(folder):
    asked = book()
    asked.add("track", {}, ["gone.csv"])
    with pytest.raises(VidtrackError, match=r"gone\.csv: cannot be read \(No such file"):
        asked.check()


def test_a_recording_that_is_none_is_told(folder):
    (folder / "runs/pluck/cam1.mov").write_bytes(b"this is a shopping list\n" * 9)
    asked = book()
    asked.add("track", {}, ["runs/pluck/cam1.mov"], "pluck", "cam1")
    with pytest.raises(VidtrackError, match=r"cam1\.mov"):
        asked.check()


def test_a_recording_that_is_none_costs_its_run_where_there_is_another(folder):
    (folder / "runs/pluck/cam1.mov").write_bytes(b"this is a shopping list\n" * 9)
    other = folder / "runs/push/cam1.csv"
    other.parent.mkdir()
    other.write_text("not a recording by its name, and none that is opened")
    asked = book()
    asked.add("track", {}, ["runs/pluck/cam1.mov"], "pluck", "cam1")
    asked.add("track", {}, ["runs/push/cam1.csv"], "push", "cam1")
    asked.check()
    other.rename(other.with_suffix(".mov"))
    asked = book()
    asked.add("track", {}, ["runs/pluck/cam1.mov"], "pluck", "cam1")
    asked.add("track", {}, ["runs/push/cam1.mov"], "push", "cam1")
    with pytest.raises(VidtrackError) as told:
        asked.check()
    assert len(told.value.problems) == 2


@pytest.mark.parametrize("name", ["new\nline", "{run}", "tab\there", "half\udc80", "\x7f"])
def test_a_name_that_cannot_be_carried_is_told_on_one_line(folder, name):
    asked = book()
    asked.add("track", {}, [f"runs/{name}/cam1.mov", f"runs/{name}/targets.csv"], name, "cam1")
    with pytest.raises(VidtrackError) as told:
        asked.check()
    (line,) = told.value.problems
    assert line == line.splitlines()[0]
    assert line.startswith(repr(f"runs/{name}"))


def test_results_that_cannot_be_written_are_told(folder):
    shutil.rmtree(folder / "results")
    (folder / "results").write_text("a file where a folder should be")
    with pytest.raises(VidtrackError, match=r"results/\.provenance: cannot be written"):
        book().check()

"""Failed jobs leave a record each, and what can be made without them is made."""

import json
import os
import sys
from pathlib import Path

import pytest

from vidtrack.workflow import conclusion
from vidtrack.workflow.conclusion import failures, same_call, write_without
from vidtrack.workflow.failure import failure_place, write_failure
from vidtrack.workflow.order_book import OrderBook


@pytest.fixture
def book(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    made = OrderBook(".", cache=".cache")
    made.add("locate", {"run": "pluck"}, [], "pluck")
    made.add("locate", {"run": "forced"}, [], "forced")
    made.add("verdict", {"all": True}, [])
    made.add("report", {"all": True}, [])
    return made


@pytest.mark.slow
def test_a_job_that_ended_without_a_word_is_given_one_and_one_that_left_its_own_keeps_it(book):
    own = book.place("locate", "forced")
    write_failure(own, "locate", ["too few points"])
    found = failures(book, [("locate", book.place("locate", "pluck")), ("locate", own)])
    assert sorted(found) == sorted(failure_place(book.place("locate", run)) for run in ("pluck", "forced"))
    silent, said = (
        json.loads(Path(failure_place(book.place("locate", run))).read_text())["findings"][0]["text"]
        for run in ("pluck", "forced")
    )
    assert silent.startswith("locate pluck ended without a message")
    assert said == "too few points"


@pytest.mark.slow
def test_a_failure_of_an_earlier_call_stands_until_the_job_runs_again(book):
    write_failure(book.place("locate", "pluck"), "locate", ["x"])
    assert failures(book, []) == [failure_place(book.place("locate", "pluck"))]


@pytest.mark.slow
def test_what_others_failed_for_is_made_of_what_there_is_and_is_partial(book, monkeypatch):
    """The report reads the verdict only if that was made just now; each account says that it is partial."""
    calls = []

    class Done:
        returncode = 0

    def run(command, input, text, check):
        calls.append((command, input))
        return Done

    monkeypatch.setattr(conclusion.subprocess, "run", run)
    wanted = {
        "verdict": (["results/a.json"], "results/verdict.json"),
        "report": (["results/verdict.json", "results/a.json"], "results/report.html"),
    }
    write_without(book, wanted, ["results/.failures/locate/pluck.json"])
    (first, order), (second, _) = calls
    assert first[:4] == [sys.executable, "-m", "vidtrack", "verdict"]
    assert first[first.index("results") + 1] == "results/.failures/locate/pluck.json"  # a.json is not as it should be
    assert "results/verdict.json" in second[second.index("results") + 1 :]
    assert '"partial":true' in order.splitlines()[2]
    assert json.loads(order.splitlines()[2])["partial"] is True

    calls.clear()
    Done.returncode = 1
    write_without(book, wanted, [])
    assert "results/verdict.json" not in calls[1][0]
    assert not os.path.exists("results/verdict.json")


def test_the_same_call_once_more_names_its_places_anew_and_keeps_its_targets():
    once = same_call(
        ["-s", "../Snakefile", "--directory", "lab", "--cores", "2", "--", "a.csv"], "/w/Snakefile", "/x/lab"
    )
    assert once[1:3] == ["-m", "snakemake"]
    assert once[-6:] == ["--snakefile", "/w/Snakefile", "--directory", "/x/lab", "--", "a.csv"]
    assert same_call([], "/w/Snakefile", "/x/lab")[3:] == ["--snakefile", "/w/Snakefile", "--directory", "/x/lab"]

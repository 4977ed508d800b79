"""The first page: a line a run and a line a camera, small however many runs there are."""

from vidtrack.report.index_page import index_page
from vidtrack.report.page_file import write_page
from vidtrack.report.run_summary import run_summary
from vidtrack.results import Results, RunResults

GOOD = {"verdict": "good", "reasons": [], "notes": []}
WHY = {"level": "doubtful", "code": "x", "text": "cam1: known to 4 ms only " * 6, "cure": "Give offset_s."}


def results(runs, made):
    summaries = {name: {**run_summary(name, RunResults()), "samples": 200, "located": 150} for name in made}
    verdict = {"verdict": "doubtful", "calibration": {**GOOD, "cameras": {"cam 1": GOOD}}, "runs": {}}
    verdict["runs"] = {name: {"verdict": "doubtful", "reasons": [WHY], "notes": [WHY]} for name in runs}
    return Results(summaries=summaries, verdict=verdict, calibration_page=True)


def index(found, runs):
    return index_page(found, units="m", runs=runs, title="tank", provenance={"vidtrack": "1"})


def test_a_run_leads_to_its_page_and_one_that_failed_has_none():
    page = index(results(["a b", "gone"], ["a b"]), ["a b", "gone"])
    assert page.links == {
        "run-a b": "report/run_a%20b.html",
        "calibration": "report/calibration.html",
        "camera-cam 1": "report/calibration.html#camera-cam%201",
    }
    runs, cameras = page.verdict.tables
    assert [row[:3] for row in runs.rows] == [["a b", "doubtful", "75 %"], ["gone", "doubtful", "–"]]
    assert list(cameras.keys) == ["camera-cam 1"]


def test_the_links_stand_in_the_page_and_what_has_no_page_leads_nowhere(tmp_path):
    write_page(tmp_path / "r.html", index(results(["a b", "gone"], ["a b"]), ["a b", "gone"]))
    text = (tmp_path / "r.html").read_text()
    assert '<a href="report/run_a%20b.html">a b</a>' in text
    assert '<td class="words">gone</td>' in text
    assert "run_gone" not in text


def test_a_season_of_100_runs_is_less_than_a_megabyte(tmp_path):
    runs = [f"run{i:03d}" for i in range(100)]
    write_page(tmp_path / "r.html", index(results(runs, runs), runs))
    assert (tmp_path / "r.html").stat().st_size < 1_000_000

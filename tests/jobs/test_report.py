"""The first page is made of summaries; pages of runs that are gone are removed."""

import builtins

from vidtrack.files.records import write_json
from vidtrack.jobs import report
from vidtrack.report.run_summary import run_summary
from vidtrack.results import RunResults
from vidtrack.workflow.job import Job


def written(folder, runs):
    """A verdict, and summaries and pages of all runs but the failed one."""
    (folder / "report").mkdir(parents=True)
    reason = {"level": "failed", "code": "track-failed", "text": "cam1.mov is cut off", "cure": "Copy it again."}
    judged = {name: {"verdict": "good", "reasons": [], "notes": []} for name in runs}
    judged["lost"] = {"verdict": "failed", "reasons": [reason], "notes": []}
    write_json(folder / "verdict.json", {"verdict": "failed", "calibration": None, "runs": judged}, {})
    for name in [*runs, "lost", "gone"]:
        write_json(folder / f"report/run_{name}.json", run_summary(name, RunResults()), {})
        (folder / f"report/run_{name}.html").write_text("<p>")
    return [folder / "verdict.json", *(folder / f"report/run_{name}.json" for name in runs)]


def test_every_file_is_opened_once_and_the_page_says_what_failed(tmp_path, monkeypatch):
    inputs = [str(path) for path in written(tmp_path / "results", ["pluck"])]
    opened = []
    real = builtins.open

    def watched(path, *rest, **more):
        opened.append(str(path))
        return real(path, *rest, **more)

    monkeypatch.setattr(builtins, "open", watched)
    settings = {"units": "m", "runs": ["pluck", "lost"], "title": "tank"}
    report.run(Job(settings, {"results": inputs}, {"report": str(tmp_path / "results/report.html")}, {"vidtrack": "1"}))
    assert all(opened.count(path) == 1 for path in inputs)
    page = (tmp_path / "results/report.html").read_text()
    assert "<title>tank: failed</title>" in page
    assert "cam1.mov is cut off." in page
    assert "What to do: Copy it again." in page
    left = sorted(path.name for path in (tmp_path / "results/report").iterdir())
    assert left == ["run_pluck.html", "run_pluck.json"]

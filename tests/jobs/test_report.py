"""The report's job reads every file once and writes one page."""

import builtins

from vidtrack.files.records import write_json
from vidtrack.jobs import report
from vidtrack.workflow.job import Job


def test_every_file_is_opened_once_and_the_page_says_what_failed(tmp_path, monkeypatch):
    results = tmp_path / "results"
    results.mkdir()
    reason = {"level": "failed", "code": "track-failed", "text": "cam1.mov is cut off", "cure": "Copy it again."}
    run = {"verdict": "failed", "reasons": [reason], "notes": []}
    write_json(results / "verdict.json", {"verdict": "failed", "calibration": None, "runs": {"pluck": run}}, {})
    opened = []
    real = builtins.open

    def watched(path, *rest, **more):
        opened.append(str(path))
        return real(path, *rest, **more)

    monkeypatch.setattr(builtins, "open", watched)
    settings = {"units": "m", "cameras": {"cam1": {}}, "runs": {"pluck": {}}, "title": "tank"}
    inputs = {"results": str(results / "verdict.json")}
    report.run(Job(settings, inputs, {"report": str(tmp_path / "report.html")}, {"vidtrack": "1"}))
    assert opened.count(str(results / "verdict.json")) == 1
    page = (tmp_path / "report.html").read_text()
    assert "<title>tank: failed</title>" in page
    assert "cam1.mov is cut off." in page
    assert "What to do: Copy it again." in page

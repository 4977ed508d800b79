"""A run is judged on its page as in verdict.json."""

import json

from vidtrack.files.records import write_json
from vidtrack.files.results_files import read_results
from vidtrack.jobs import report_run
from vidtrack.stages.verdict import verdict
from vidtrack.workflow.job import Job

DOUBT = {"level": "doubtful", "code": "clock-uncertain", "text": "cam1: known to 9 ms only", "cure": "Clap."}


def test_the_page_has_the_verdict_and_the_summary_the_numbers(tmp_path):
    folder = tmp_path / "results/runs/beach"
    folder.mkdir(parents=True)
    paths = [str(folder / "waterline.json")]
    write_json(paths[0], {"transects": {}, "findings": [DOUBT]}, {})
    asked = {"mode": "waterline", "cameras": ["cam1"], "targets": None}
    settings = {"run": "beach", "units": "m", "cameras": ["cam1"], "title": "tank", "asked": asked}
    outputs = {"page": str(tmp_path / "p.html"), "summary": str(tmp_path / "s.json")}
    report_run.run(Job(settings, {"results": paths}, outputs, {"vidtrack": "1"}))
    judged = verdict(read_results(paths), {"beach": asked})["runs"]["beach"]["verdict"]
    page = (tmp_path / "p.html").read_text()
    assert judged == "doubtful"
    assert f"<title>tank: beach: {judged}</title>" in page
    assert "cam1: known to 9 ms only." in page
    assert json.loads((tmp_path / "s.json").read_text())["run"] == "beach"

"""A run is judged on its page as in verdict.json."""

import json

from vidtrack.files.records import write_json
from vidtrack.files.results_files import read_results
from vidtrack.jobs import report_run
from vidtrack.stages.verdict import calibration_verdict, verdict
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


def test_the_calibration_is_judged_once_for_all_runs_and_anew_where_a_file_of_it_is_another(tmp_path, monkeypatch):
    judged = []
    monkeypatch.setattr(report_run, "calibration_verdict", lambda results: judged.append(results) or plain(results))
    plain = calibration_verdict
    survey = str(tmp_path / "results/calibration/survey.json")
    asked = {"mode": "waterline", "cameras": [], "targets": None}

    def page_of(run):
        path = str(tmp_path / f"results/runs/{run}/waterline.json")
        write_json(path, {"transects": {}, "findings": [DOUBT | {"text": f"seen in {run} alone"}]}, {})
        settings = {"run": run, "units": "m", "cameras": [], "title": "tank", "asked": asked}
        outputs = {"page": str(tmp_path / "p.html"), "summary": str(tmp_path / "s.json")}
        report_run.run(Job(settings, {"results": [survey, path]}, outputs, {"vidtrack": "1"}))
        return (tmp_path / "p.html").read_text()

    write_json(survey, {"findings": [DOUBT | {"code": "survey", "text": "sinks"}]}, {})
    first, second = page_of("a"), page_of("b")
    assert "sinks" in first
    assert "seen in a alone" in first
    assert "sinks" in second
    assert "seen in b alone" in second
    assert "seen in a alone" not in second
    assert len(judged) == 1
    write_json(survey, {"findings": [DOUBT | {"code": "survey", "text": "stands"}]}, {})
    assert "stands" in page_of("b")
    assert len(judged) == 2

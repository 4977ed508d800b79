"""The page of the calibration is judged as in verdict.json."""

from vidtrack.files.records import write_json
from vidtrack.jobs import report_calibration
from vidtrack.workflow.job import Job

BAD = {"level": "bad", "code": "few-points", "text": "cam1: 4 points only", "cure": "Film more."}


def test_the_page_says_what_is_wrong_with_each_camera(tmp_path):
    folder = tmp_path / "results/calibration/cam1"
    folder.mkdir(parents=True)
    write_json(folder / "labelling.json", {"findings": [BAD]}, {})
    job = Job(
        {"units": "m", "title": "tank", "cameras": ["cam1"]},
        {"results": [str(folder / "labelling.json")]},
        {"page": str(tmp_path / "c.html")},
        {"vidtrack": "1"},
    )
    report_calibration.run(job)
    page = (tmp_path / "c.html").read_text()
    assert "<title>tank: calibration: bad</title>" in page
    assert '<a href="#camera-cam1">Camera cam1</a>' in page
    assert "cam1: 4 points only." in page
    assert '<section id="camera-cam1">' in page

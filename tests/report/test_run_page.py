"""Which sections and figures the page of a run shows, of what is there."""

import numpy as np
import pandas as pd

from vidtrack.report import run_page as page_of_run
from vidtrack.report.run_page import run_page
from vidtrack.results import CameraResults, Results, RunResults

T = np.arange(60) / 30 + 36000.0
MADE = {"vidtrack": "1", "commit": "0123456789abcdef", "libraries": {"numpy": "2.0"}}
LOST = {"level": "failed", "code": "x", "text": "cam1.mov: no picture could be decoded", "cure": "Copy it again."}


def run(**more):
    table = pd.DataFrame({"time_s": T, "target": "t1", "x": np.sin(T), "y": np.cos(T), "z": 0 * T, "flag": ""})
    table = table.assign(sigma_x=0.01, sigma_y=0.01, sigma_z=0.01)
    speed = {f"{kind}{axis}": 1.0 for kind in "va" for axis in "xyz"}
    return RunResults(tables={"trajectories": table, "kinematics": table.assign(**speed)}, **more)


def page(results):
    return run_page("pluck", results, units="m", cameras=["cam1"], title="tank", provenance=MADE)


ORDER = ("Position against time", "The paths", "Velocity and acceleration")
"""Figures of any located run, as they follow each other; others may stand between them."""


def captions(section):
    return [figure.caption.split(";")[0] for figure in section.figures]


def test_a_run_shows_its_positions_and_its_motion():
    made = page(Results(runs={"pluck": run(records={"locate": {"mode": "plane"}})}))
    assert made.title == "tank: pluck"
    assert [section.key for section in made.sections] == ["run-pluck"]
    shown = captions(made.sections[0])
    assert [c for c in shown if c in ORDER] == list(ORDER)
    assert made.nav == [("Overview", "../report.html")]


def test_the_survey_is_drawn_only_where_a_run_was_located_in_space():
    points = pd.DataFrame({"tag": ["1"], "x": [0.0], "y": [0.0], "z": [0.0], "used": True, "Xf": 1.0, "Yf": 1.0})
    cameras = {"cam1": CameraResults(points=points)}
    made = page(Results(cameras=cameras, runs={"pluck": run(records={"locate": {"mode": "space"}})}))
    assert "From above and from the side, among the calibration points" in captions(made.sections[0])
    assert made.nav[1] == ("Calibration", "calibration.html")


def test_a_run_without_positions_shows_why_and_no_figure():
    nothing = run(records={"locate": {"mode": "space"}})
    nothing.tables["trajectories"][["x", "y", "z"]] = np.nan
    nothing.tables["kinematics"]["vx"] = np.nan
    judged = {"verdict": "failed", "reasons": [LOST], "notes": []}
    made = page(Results(runs={"pluck": nothing}, verdict={"runs": {"pluck": judged}}))
    assert captions(made.sections[0]) == []
    assert made.verdict.word == "failed"
    assert made.verdict.reasons[0].text == "cam1.mov: no picture could be decoded."
    assert made.verdict.reasons[0].key == made.sections[0].key


def test_the_foot_says_the_units_and_by_what_the_page_was_made():
    units, made = page(Results()).footer
    assert "unit of length is m" in units
    assert made.startswith("Made by vidtrack 1, commit 0123456789ab, numpy 2.0.")


def test_a_poster_leads_to_the_film_beside_the_results_of_the_run(tmp_path):
    (tmp_path / "overlay_cam1.jpg").write_bytes(b"\xff\xd8")
    (figure,) = page_of_run.posters("r 1", RunResults(posters={"cam1": str(tmp_path / "overlay_cam1.jpg")}))
    assert figure.link == "../runs/r%201/overlay_cam1.mp4"
    assert figure.uri.startswith("data:image/jpeg;base64,")

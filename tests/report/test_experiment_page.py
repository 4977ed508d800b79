"""Which sections and figures the page shows, of what is there."""

import numpy as np
import pandas as pd

from vidtrack.report.experiment_page import experiment_page
from vidtrack.results import CameraResults, Results, RunResults

T = np.arange(60) / 30 + 36000.0
LOST = {
    "level": "failed",
    "code": "track-failed",
    "text": "cam1.mov: no picture could be decoded",
    "cure": "Copy it again.",
}


MADE = {"vidtrack": "1", "commit": "0123456789abcdef", "libraries": {"numpy": "2.0"}}


def run(**more):
    table = pd.DataFrame({"time_s": T, "target": "t1", "x": np.sin(T), "y": np.cos(T), "z": 0 * T, "flag": ""})
    table = table.assign(sigma_x=0.01, sigma_y=0.01, sigma_z=0.01)
    speed = {f"{kind}{axis}": 1.0 for kind in "va" for axis in "xyz"}
    return RunResults(tables={"trajectories": table, "kinematics": table.assign(**speed)}, **more)


def page(results, runs):
    return experiment_page(results, units="m", cameras=["cam1"], runs=runs, title="tank", provenance=MADE)


def keys(sections):
    return [(section.key, keys(section.sections)) for section in sections]


def captions(section):
    return [figure.caption.split(";")[0] for figure in section.figures]


def test_a_run_shows_its_positions_and_its_motion():
    made = page(Results(runs={"pluck": run(records={"locate": {"mode": "plane"}})}), ["pluck"])
    assert keys(made.sections) == [("runs", [("run-pluck", [])])]
    assert captions(made.sections[0].sections[0]) == ["Position against time", "The paths", "Velocity and acceleration"]
    assert made.lead == ("1 run: pluck.",)


def test_the_survey_is_drawn_only_where_a_run_was_located_in_space():
    points = pd.DataFrame({"tag": ["1"], "x": [0.0], "y": [0.0], "z": [0.0], "used": True, "Xf": 1.0, "Yf": 1.0})
    cameras = {"cam1": CameraResults(points=points)}
    made = page(Results(cameras=cameras, runs={"pluck": run(records={"locate": {"mode": "space"}})}), ["pluck"])
    assert "From above and from the side, among the calibration points" in captions(made.sections[1].sections[0])


def test_a_page_is_made_also_of_runs_and_cameras_that_failed_and_every_reason_leads_to_its_section():
    failed = {"verdict": "failed", "reasons": [LOST], "notes": []}
    calibration = {**failed, "cameras": {"cam1": failed}}
    verdict = {"verdict": "failed", "calibration": calibration, "runs": {"pluck": failed, "empty": failed}}
    nothing = run(records={"locate": {"mode": "space"}})
    nothing.tables["trajectories"][["x", "y", "z"]] = np.nan
    nothing.tables["kinematics"]["vx"] = np.nan
    made = page(Results(runs={"empty": nothing}, verdict=verdict), ["pluck", "empty"])
    assert keys(made.sections) == [
        ("calibration", [("camera-cam1", [])]),
        ("runs", [("run-pluck", []), ("run-empty", [])]),
    ]
    assert captions(made.sections[1].sections[1]) == []
    assert made.sections[1].sections[0].lines == ["Nothing was located in this run: see the verdict."]
    assert made.verdict.reasons[0].text == "cam1.mov: no picture could be decoded."
    there = {key for part in made.sections for key in (part.key, *(inner.key for inner in part.sections))}
    assert {reason.key for reason in made.verdict.reasons} <= there


def test_the_foot_says_the_units_and_by_what_the_page_was_made():
    units, made = page(Results(), []).footer
    assert "unit of length is m" in units
    assert made.startswith("Made by vidtrack 1, commit 0123456789ab, numpy 2.0.")


def test_a_search_of_few_places_has_no_map():
    search = pd.DataFrame({"varied": "centre", "Cx": [1.0], "Cy": [1.0], "rms_px": [0.1], "sensor_width": [8.8]})
    record = {"camera": "cam1", "model": "tsai", "refine": "full", "n_points": 9, "n_sighted": 9, "rms_px": 0.1}
    record |= {"max_px": 0.2, "Cx": 1.0, "Cy": 1.0, "f": 8.0, "dx": 1.0, "dy": 1.0, "position": [0.0, 0.0, 1.0]}
    own = CameraResults(record=record, search=search, labelling={})
    made = page(Results(cameras={"cam1": own}), [])
    (camera,) = made.sections[0].sections
    assert camera.key == "camera-cam1"
    assert list(camera.figures) == []

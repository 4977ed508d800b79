"""Which figures a run shows, and that none is drawn of what is not there."""

import base64

import cv2
import numpy as np
import pandas as pd

from vidtrack.report.run_figures import run_figures
from vidtrack.results import Results, RunResults

T = np.arange(60) / 30 + 36000.0
COUNTS = {"counts": [1, 1], "edges": [-0.5, 0.0, 0.5]}


def captions(run):
    return [
        caption.split(";")[0].split(":")[0]
        for caption, *_ in run_figures("r", Results(runs={"r": run}), {"cam1": "red"}, "m")
    ]


def reading(worst=()):
    return {"pixel_locking": {"x": COUNTS, "y": COUNTS}, "worst": list(worst)}


def centroids():
    return pd.DataFrame({"time_s": T, "target": "t1", "Xf": np.sin(T), "Yf": np.cos(T)})


def test_a_run_of_which_nothing_was_made_has_no_figure():
    assert captions(RunResults()) == []


def test_a_run_that_was_tracked_and_not_located_shows_its_tracks():
    run = RunResults(centroids={"cam1": centroids()}, readings={"cam1": reading()})
    assert captions(run) == ["Centroids of each target in each camera's picture against time", "Pixel locking"]


def test_the_worst_samples_are_shown_where_a_reading_kept_any():
    _, png = cv2.imencode(".png", np.full((9, 9), 90, np.uint8))
    picture = "data:image/png;base64," + base64.b64encode(png.tobytes()).decode()
    worst = [{"picture": picture, "frame": 3, "target": "t1", "flag": "merged"}]
    run = RunResults(centroids={"cam1": centroids()}, readings={"cam1": reading(worst)})
    assert captions(run)[-1] == "The samples that went worst"


def test_the_search_for_a_clock_is_shown_where_one_was_made():
    own = {"offset_s": 0.01, "offsets_s": [0.0, 0.01], "error_px": [1.0, 0.1]}
    run = RunResults(centroids={"cam1": centroids()}, readings={"cam1": reading()})
    run.records["locate"] = {"clocks": {"cameras": {"cam1": own}}}
    assert captions(run)[0] == "Epipolar error against the clock offset of each camera"


def test_the_waters_edge_needs_no_target():
    stack = {"grey": np.zeros((60, 4)), "time_s": T, "s": np.linspace(0, 4, 4)}
    runup = pd.DataFrame({"time_s": T, "transect": "mid", "s": 2.0, "z": 0.5, "sigma_z": 0.01})
    run = RunResults(tables={"waterline": runup}, timestacks={"mid": stack})
    assert captions(run) == ["Timestack and the water's edge"]

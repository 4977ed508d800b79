"""What the page of the calibration shows, of what is there."""

import pandas as pd

from vidtrack.report.calibration_page import calibration_page
from vidtrack.results import CameraResults, Results


def page(results):
    return calibration_page(results, units="m", title="tank", provenance={"vidtrack": "1"})


def test_a_search_of_few_places_has_no_map():
    search = pd.DataFrame({"varied": "centre", "Cx": [1.0], "Cy": [1.0], "rms_px": [0.1], "sensor_width": [8.8]})
    record = {"camera": "cam1", "model": "tsai", "refine": "full", "n_points": 9, "n_sighted": 9, "rms_px": 0.1}
    record |= {"max_px": 0.2, "Cx": 1.0, "Cy": 1.0, "f": 8.0, "dx": 1.0, "dy": 1.0, "position": [0.0, 0.0, 1.0]}
    own = CameraResults(record=record, search=search, labelling={})
    made = page(Results(cameras={"cam1": own}))
    (camera,) = made.sections[0].sections
    assert camera.key == "camera-cam1"
    assert list(camera.figures) == []


def test_a_camera_that_failed_has_a_section_to_which_its_reason_leads():
    why = {"level": "failed", "code": "x", "text": "no points", "cure": "Film them."}
    failed = {"verdict": "failed", "reasons": [why], "notes": []}
    made = page(Results(verdict={"calibration": {**failed, "cameras": {"cam1": failed}}}))
    assert made.verdict.word == "failed"
    (camera,) = made.sections[0].sections
    assert camera.lines == ["This camera was not calibrated: see the verdict."]
    assert {reason.key for reason in made.verdict.reasons} == {camera.key}

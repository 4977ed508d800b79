"""What the page of the calibration shows, of what is there."""

import cv2
import numpy as np
import pandas as pd

from tests.report.test_space_view import results as rig
from vidtrack.geometry.camera import project
from vidtrack.report.calibration_page import calibration_page
from vidtrack.report.space_view import camera_of
from vidtrack.results import CameraResults, Results


def page(results):
    return calibration_page(results, units="m", cameras=["cam1"], title="tank", provenance={"vidtrack": "1"})


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


def test_a_calibrated_camera_shows_the_rig_and_the_pictures_of_showcalb(tmp_path):
    found = rig()
    own = found.cameras["cam1"]
    own.record |= {"camera": "cam1", "model": "tsai", "refine": "full", "n_points": 8, "n_sighted": 8, "rms_px": 0.1}
    own.record |= {"max_px": 0.2, "position": [0.0, -9.0, 0.0]}
    own.points = own.points.assign(used=True)
    cv2.imwrite(str(tmp_path / "picture.png"), np.full((480, 512), 30, np.uint8))
    own.picture = str(tmp_path / "picture.png")
    at = own.points.drop_duplicates("tag")[["x", "y", "z"]].to_numpy()
    found.back_table = pd.DataFrame({"tag": [str(i) for i in range(8)], "camera": "cam1"})
    found.back_table[["x_located", "y_located", "z_located"]] = at
    for name in ("", "_projected", "_no_distortion", "_from_located"):
        found.back_table[[f"Xf{name}", f"Yf{name}"]] = project(camera_of(own.record), at)
    whole = page(found).sections[0]
    assert whole.figures[0].caption.startswith("Cameras with a third of their view")
    assert '"cameras":[{"name":"cam1"' in whole.figures[0].live
    (camera,) = whole.sections
    assert [figure.caption.split(":")[0] for figure in camera.figures] == ["Calibration points in the picture"]

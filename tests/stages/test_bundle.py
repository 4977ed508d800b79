"""The bundle as a stage: what each camera.json says of it, and when it refuses."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.jobs import bundle as job_module
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.bundle import refine_together, ties_among

FREE = free_parameters("tsai")
SIGMA = 1 / 32 / np.sqrt(3)


def _rig(seed=0, surveyed=None):
    rng = np.random.default_rng(seed)
    tags, p = thesis_points()
    told = p if surveyed is None else surveyed
    true = p + rng.uniform(-1, 1, p.shape) / 32
    fits, tables = [], []
    for camera in thesis_rig():
        b = project(camera, true) + rng.normal(0, 0.05, (64, 2))
        fits.append(refine(camera, told, b, free=FREE))
        places = {"tag": tags, "x": told[:, 0], "y": told[:, 1], "z": told[:, 2], "sigma": SIGMA}
        tables.append(pd.DataFrame({"clip": "row", **places, "Xf": b[:, 0], "Yf": b[:, 1], "used": True, "reason": ""}))
    return true, fits, tables


def test_points_come_out_nearer_to_the_truth_than_their_survey():
    true, fits, tables = _rig()
    done = refine_together([fit.camera for fit in fits], tables)
    found = done.points[["x", "y", "z"]].to_numpy()
    surveyed = thesis_points()[1]
    rms = [np.sqrt(np.mean((each - true) ** 2)) for each in (found, surveyed)]
    assert rms[0] < 0.75 * rms[1]
    told = done.points[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()
    assert 0.6 < np.mean(((found - true) / told) ** 2) < 1.6  # one trial, whose points err together


def test_the_record_says_what_the_bundle_found():
    _, fits, tables = _rig()
    tables[0].loc[5, "used"] = False
    done = refine_together([fit.camera for fit in fits], tables)
    record = done.records[0]
    assert (record["refine"], record["n_points"]) == ("bundle", 63)
    assert record["sigma_px"] == pytest.approx(0.05, rel=0.3)
    assert record["bundle"]["survey_factor"] == pytest.approx(1, abs=0.3)
    assert record["rms_px"] < fits[0].rms_px  # the survey's errors no longer bend it
    assert record["bundle"]["joint_covariance"].shape == (22, 22)
    assert record["bundle"]["findings"] == []
    assert done.uncertainties[0].names == FREE


def test_a_ball_that_hangs_elsewhere_is_named():
    wrong = thesis_points()[1].copy()
    wrong[30, 1] += 0.3
    _, fits, tables = _rig(surveyed=wrong)
    done = refine_together([fit.camera for fit in fits], tables)
    (finding,) = done.records[0]["bundle"]["findings"]
    assert finding["code"] == "point-off-survey"
    assert "cam1, cam2: tag 31 lies" in finding["text"]
    assert "y -0." in finding["text"]


def test_an_exact_survey_is_refused_with_its_cure():
    _, fits, tables = _rig()
    with pytest.raises(VidtrackError, match=r"calibration.sigma: 0.*calibration.refine: full"):
        refine_together([fit.camera for fit in fits], [table.assign(sigma=0.0) for table in tables])


def test_too_few_sights_are_refused_in_one_line():
    _, fits, tables = _rig()
    with pytest.raises(VidtrackError, match=r"camera 1: 6 measurements for 11"):
        refine_together([fit.camera for fit in fits], [tables[0], tables[1].head(3)])


def test_a_tie_counts_where_it_joins_two_of_the_cameras():
    ties = [{"cameras": ["a", "b"]}, {"cameras": ["b", "x"]}, {"cameras": ["x", "y"]}]
    assert ties_among(ties, ["a", "b", "c"]) == ties[:1]


def test_the_job_writes_a_camera_json_for_each_camera(tmp_path):
    from vidtrack.files.camera_json import read_camera, write_camera
    from vidtrack.files.tables import read_parquet, write_parquet
    from vidtrack.workflow.job import Job

    _, fits, tables = _rig()
    inputs, outputs = {"alone": [], "points": []}, {"survey": str(tmp_path / "survey.parquet")}
    for fit, table in zip(fits, tables, strict=True):
        name = fit.camera.name
        inputs["alone"].append(str(tmp_path / f"{name}.alone.json"))
        inputs["points"].append(str(tmp_path / f"{name}.parquet"))
        outputs[name] = str(tmp_path / f"{name}.json")
        extra = {"model": "tsai", "units": "in", "refine": "bundle", "rms_px": fit.rms_px, "warnings": ["heed"]}
        write_camera(inputs["alone"][-1], fit.camera, fit.uncertainty, extra)
        write_parquet(inputs["points"][-1], table, units="in", provenance={})
    settings = {"units": "in", "cameras": ["cam1", "cam2"], "fix": {}, "prior": {}, "sigma": 0.0}
    job_module.run(Job(settings=settings, inputs=inputs, outputs=outputs, provenance={"vidtrack": "x"}))
    written = read_camera(outputs["cam2"])
    assert written.record["camera"] == "cam2"
    assert written.record["model"] == "tsai"
    assert written.record["alone"]["rms_px"] == pytest.approx(fits[1].rms_px)
    assert written.record["warnings"] == ["heed"]
    assert written.record["provenance"] == {"vidtrack": "x"}
    assert written.uncertainty.names == FREE
    assert len(read_parquet(outputs["survey"])) == 64

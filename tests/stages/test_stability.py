"""Before and after a test: the camera that sagged is named, and what it cost is told."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.jobs import stability as job_module
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.stability import stability

FREE = free_parameters("tsai")
SIGMA = 1 / 32 / np.sqrt(3)


def _calibration(cameras, rng):
    tags, p = thesis_points()
    fits, tables = [], []
    true = p + rng.uniform(-1, 1, p.shape) / 32
    for camera in cameras:
        b = project(camera, true) + rng.normal(0, 0.1, (64, 2))
        fits.append(refine(camera, p, b, free=FREE, sd=0.1, survey=SIGMA))
        places = {"tag": tags, "x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "sigma": SIGMA}
        tables.append(pd.DataFrame({"clip": "row", **places, "Xf": b[:, 0], "Yf": b[:, 1], "used": True, "reason": ""}))
    return fits, tables


def _compared(before, after, **more):
    return stability(
        *([fit.camera for fit in fits] for fits in (before[0], after[0])),
        *(before[1], after[1]),
        uncertainties=tuple([fit.uncertainty for fit in fits] for fits in (before[0], after[0])),
        units="in",
        **more,
    )


def _sagged(camera, degrees):
    R = rotation_from_vector([np.radians(degrees), 0, 0]) @ camera.R
    return camera.with_(R=R, T=-R @ camera.position)


def test_the_camera_that_sagged_is_named_and_the_other_is_not():
    rng = np.random.default_rng(0)
    rig = thesis_rig()
    record = _compared(_calibration(rig, rng), _calibration([_sagged(rig[0], 0.1), rig[1]], rng))
    sagged, steady = record["cameras"]["cam1"], record["cameras"]["cam2"]
    assert sagged["moved"]
    assert sagged["only_turned"]
    assert sagged["turn_in_place_deg"]["tilt_down"] == pytest.approx(0.1, abs=0.008)
    assert not steady["moved"]
    assert steady["distance"] < 5 * steady["distance_sd"]
    (finding,) = record["findings"]
    assert finding["code"] == "camera-moved"
    assert finding["text"].startswith("cam1: turned by 0.09")


def test_the_errors_by_axis_tell_what_the_movement_costs():
    """0.1 degrees are 0.28 in at 160 in; both cameras share it between them."""
    rng = np.random.default_rng(1)
    rig = thesis_rig()
    located = _compared(_calibration(rig, rng), _calibration([_sagged(rig[0], 0.1), rig[1]], rng))["located"]
    assert 0.15 < located["with_before"]["mean_3d"] < 0.35
    assert 0.03 < located["with_after"]["mean_3d"] < 0.06
    assert located["with_before"]["mean_abs"].keys() == {"x", "y", "z"}


def test_a_zoomed_lens_is_told():
    rng = np.random.default_rng(2)
    rig = thesis_rig()
    zoomed = [rig[0].with_(f=rig[0].f * 1.06), rig[1]]
    record = _compared(_calibration(rig, rng), _calibration(zoomed, rng))
    assert any(f["code"] == "lens-changed" and "cam1: f changed" in f["text"] for f in record["findings"])


def test_a_camera_with_too_few_later_points_is_not_judged():
    rng = np.random.default_rng(3)
    before, after = _calibration(thesis_rig(), rng), _calibration(thesis_rig(), rng)
    after[1][1]["used"] = [True] * 3 + [False] * 61
    record = _compared(before, after)
    assert record["cameras"]["cam2"]["moved"] is None
    assert "3 points" in record["findings"][0]["text"]


def test_the_job_writes_the_record(tmp_path):
    from vidtrack.files.camera_json import write_camera
    from vidtrack.files.records import read_json
    from vidtrack.files.tables import write_parquet
    from vidtrack.workflow.job import Job

    rng = np.random.default_rng(4)
    inputs = {}
    for name in ("before", "after"):
        fits, tables = _calibration(thesis_rig(), rng)
        inputs[name], inputs[f"{name}_points"] = [], []
        for fit, table in zip(fits, tables, strict=True):
            inputs[name].append(str(tmp_path / f"{name}.{fit.camera.name}.json"))
            inputs[f"{name}_points"].append(str(tmp_path / f"{name}.{fit.camera.name}.parquet"))
            write_camera(inputs[name][-1], fit.camera, fit.uncertainty, {"model": "tsai"})
            write_parquet(inputs[f"{name}_points"][-1], table, units="in", provenance={})
    out = str(tmp_path / "stability.json")
    job_module.run(Job(settings={"units": "in", "sigma": 0.0}, inputs=inputs, outputs={"record": out}))
    record = read_json(out)
    assert set(record["cameras"]) == {"cam1", "cam2"}
    assert not record["findings"]


def test_clips_after_the_test_of_another_size_show_no_movement_and_are_named():
    rng = np.random.default_rng(0)
    before, after = _calibration(thesis_rig(), rng), _calibration(thesis_rig(), rng)
    small = after[0][0].camera.with_(image_size=(256, 240))
    after[0][0] = after[0][0]._replace(camera=small)
    record = _compared(before, after)
    assert record["cameras"]["cam1"]["moved"] is None
    assert record["cameras"]["cam2"]["moved"] is False
    assert record["located"] is None
    (finding,) = record["findings"]
    assert finding["code"] == "picture-size-differs"
    assert "512 x 480 px before the test and 256 x 240" in finding["text"]

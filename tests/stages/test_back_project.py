"""The stage that holds a calibration against its points: columns, numbers, and what it does with what is missing."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.jobs import back_project as job_module
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.back_project import back_project
from vidtrack.stages.bundle import refine_together

FREE = free_parameters("tsai")
SIGMA = 1 / 32 / np.sqrt(3)
CONTRACT = (
    *("tag", "x", "y", "z", "x_located", "y_located", "z_located", "n_cameras", "Xf", "Yf"),
    *("Xf_projected", "Yf_projected", "Xf_no_distortion", "Yf_no_distortion", "Xf_from_located", "Yf_from_located"),
)


def _table(b, sigma=SIGMA):
    tags, p = thesis_points()
    row = {"clip": "row", "tag": tags, "x": p[:, 0], "y": p[:, 1], "z": p[:, 2], "sigma": sigma}
    return pd.DataFrame({**row, "Xf": b[:, 0], "Yf": b[:, 1], "used": True, "reason": ""})


def _rig(seed=0, noise=0.1, survey=1 / 32, m=2):
    rng = np.random.default_rng(seed)
    p = thesis_points()[1]
    true = p + rng.uniform(-survey, survey, p.shape)
    sights = [project(camera, true) + rng.normal(0, noise, (64, 2)) for camera in thesis_rig(m)]
    cameras = [refine(camera, p, b, free=FREE).camera for camera, b in zip(thesis_rig(m), sights, strict=True)]
    return cameras, [_table(b) for b in sights]


@pytest.fixture(scope="module")
def done():
    cameras, tables = _rig()
    tables[0].loc[3, ["used", "reason"]] = [False, "9.0 px off"]
    tables[1].loc[10, ["Xf", "Yf"]] = np.nan
    tables[1].loc[10, ["used", "reason"]] = [False, "not found"]
    return cameras, tables, back_project(cameras, tables, units="in")


def test_the_table_has_a_row_for_each_camera_and_point_and_the_contract_columns(done):
    _, _, found = done
    assert set(CONTRACT) <= set(found.table.columns)
    assert len(found.table) == 128
    assert found.table.groupby("camera").size().to_dict() == {"cam1": 64, "cam2": 64}


def test_located_points_project_back_near_their_sights(done):
    """With two cameras the located point takes up three of four coordinates: the rest is half a pixel's noise each."""
    _, _, found = done
    left = found.table[["Xf", "Yf"]].to_numpy() - found.table[["Xf_from_located", "Yf_from_located"]].to_numpy()
    located = found.table["n_cameras"] == 2
    assert located.sum() == 124
    assert 0.03 < np.sqrt(np.nanmean(left[located] ** 2)) < 0.07  # .1 px / 2


def test_a_rejected_or_lost_sight_locates_nothing_but_stays_in_the_table(done):
    _, _, found = done
    for tag, camera, reason in (("4", "cam1", "9.0 px off"), ("11", "cam2", "not found")):
        row = found.table.set_index(["tag", "camera"]).loc[tag, camera]
        assert (row["used"], row["reason"], row["n_cameras"]) == (False, reason, 0)
        assert np.isnan(row["x_located"])
        assert np.isfinite(row["Xf_projected"])


def test_no_distortion_differs_from_projected_by_the_lens(done):
    cameras, _, found = done
    own = found.table[found.table["camera"] == "cam1"]
    pinhole = cameras[0].with_(kappa1=0.0)
    np.testing.assert_allclose(own[["Xf_no_distortion", "Yf_no_distortion"]], project(pinhole, own[["x", "y", "z"]]))


def test_the_record_tells_the_thesis_table_the_held_out_errors_and_their_ratio_to_the_floor(done):
    _, _, found = done
    record = found.record
    assert record["n_points"] == 64
    assert record["n"] == 62
    assert record["diagonal_field"] == pytest.approx(160, rel=0.02)
    assert record["largest_distance"] == pytest.approx(np.sqrt(54**2 + 12**2 + 18**2))
    assert record["held_out"]["method"] == "leave-one-out"
    assert record["held_out"]["mean_3d"] > record["mean_3d"]
    assert record["one_over_share_of_diagonal_field"] == pytest.approx(record["diagonal_field"] / record["mean_3d"])
    for axis in "xyz":
        assert 0 < record["mean_abs"][axis] < record["max_abs"][axis]
        assert record["worst"][axis]["tag"] in set(found.table["tag"])
    assert record["floor"]["sigma_px"] == pytest.approx(0.1, rel=0.25)  # 62 redundant sights: 9 % of scatter
    assert 0.9 < record["ratio_with_survey"] < 1.3
    assert record["ratio"] > record["ratio_with_survey"]
    assert set(record["measures"]["cam1"]) == {"distorted", "undistorted", "object_space", "normalised"}
    assert record["measures"]["cam1"]["distorted"]["n"] == 63


@pytest.mark.parametrize("how", ["linear", "centre", "bundle"])
def test_every_way_to_calibrate_is_held_out_by_its_own_refit(how):
    cameras, tables = _rig(1)
    record = back_project(cameras, tables, refine=how).record
    assert 0.9 < record["ratio_with_survey"] < 1.6


def test_perfect_sights_are_located_where_they_were_surveyed():
    cameras, tables = _rig(0, noise=0.0, survey=0.0)
    found = back_project(cameras, [table.assign(sigma=0.0) for table in tables])
    assert max(found.record["max_abs"].values()) < 1e-6
    assert found.record["held_out"]["max_3d"] < 1e-5


def test_one_camera_has_measures_but_no_positions():
    cameras, tables = _rig(m=1)
    found = back_project(cameras, tables)
    assert found.table["x_located"].isna().all()
    assert np.isnan(found.record["mean_3d"])
    assert found.record["held_out"]["rms_px"] > 0.1
    assert found.record["measures"]["cam1"]["distorted"]["n"] == 64


def test_points_without_clip_sigma_or_reason_will_do():
    cameras, tables = _rig()
    plain = [table.drop(columns=["clip", "sigma", "reason"]) for table in tables]
    assert back_project(cameras, plain, sigma=SIGMA).record["n"] == 64


def test_priors_of_fixed_parameters_are_passed_over():
    cameras, tables = _rig()
    free = [free_parameters("tsai", ("Cx",))] * 2
    assert back_project(cameras, tables, free=free, prior={"Cx": (256.0, 5.0)}).record["n"] == 64


def test_the_job_writes_both_outputs(tmp_path):
    from vidtrack.files.camera_json import write_camera
    from vidtrack.files.records import read_json
    from vidtrack.files.tables import read_parquet, read_units, write_parquet
    from vidtrack.workflow.job import Job

    cameras, tables = _rig()
    paths = {"cameras": [], "points": []}
    for camera, table in zip(cameras, tables, strict=True):
        fit = refine(camera, thesis_points()[1], table[["Xf", "Yf"]].to_numpy(), free=FREE)
        paths["cameras"].append(str(tmp_path / f"{camera.name}.json"))
        paths["points"].append(str(tmp_path / f"{camera.name}.parquet"))
        write_camera(paths["cameras"][-1], camera, fit.uncertainty, {"model": "tsai"})
        write_parquet(paths["points"][-1], table, units="in", provenance={})
    outputs = {"table": str(tmp_path / "bp.parquet"), "record": str(tmp_path / "bp.json")}
    settings = {"units": "in", "cameras": ["cam1", "cam2"], "refine": "full", "fix": {}, "prior": {}, "sigma": 0.0}
    job_module.run(Job(settings=settings, inputs=paths, outputs=outputs, provenance={"vidtrack": "x"}))
    assert read_json(outputs["record"])["n"] == 64
    assert read_json(outputs["record"])["provenance"] == {"vidtrack": "x"}
    assert len(read_parquet(outputs["table"])) == 128
    assert read_units(outputs["table"])["x_held_out"] == "in"


def test_points_that_fit_better_than_their_stated_tolerance_are_a_finding():
    cameras, points = _rig(noise=0.02, survey=1 / 32)
    stated = [table.assign(sigma=1.0) for table in points]  # a survey stated 32 times too coarse
    record = back_project(cameras, stated, units="in").record
    assert [f["code"] for f in record["findings"]] == ["lens-model-too-plain"]
    assert "tolerance (sigma)" in record["findings"][0]["cure"]
    assert "where the config names a plain lens model" in record["findings"][0]["cure"]
    assert record["warnings"] == [f"{record['findings'][0]['text']}. {record['findings'][0]['cure']}"]
    assert back_project(cameras, points, units="in").record["findings"] == []


def test_residuals_that_the_centroids_explain_are_no_fault_of_the_lens():
    """A survey better than its stated tolerance: a note, where the sd of the centroids says that these are as good."""
    cameras, points = _rig(noise=0.02, survey=0.0)
    known = [table.assign(sigma=0.03, sd_x=0.02, sd_y=0.02) for table in points]
    (finding,) = back_project(cameras, known, units="in").record["findings"]
    assert (finding["level"], finding["code"]) == ("note", "survey-better-than-stated")
    finer = [table.assign(sd_x=0.004, sd_y=0.004) for table in known]  # residuals are five times that
    (finding,) = back_project(cameras, finer, units="in").record["findings"]
    assert (finding["level"], finding["code"]) == ("doubtful", "lens-model-too-plain")


def test_a_lens_too_rich_for_its_points_is_a_finding():
    cameras, points = _rig(noise=0.5, survey=0.3)
    few = [table.iloc[::7].reset_index(drop=True) for table in points]
    refitted = []
    for camera, table in zip(cameras, few, strict=True):
        p, b = table[["x", "y", "z"]].to_numpy(), table[["Xf", "Yf"]].to_numpy()
        refitted.append(refine(camera, p, b, free=free_parameters("tsai")).camera.with_(name=camera.name))
    record = back_project(refitted, [table.assign(sigma=0.0) for table in few], units="in").record
    assert "lens-model-too-rich" in [f["code"] for f in record["findings"]]


def test_the_held_out_error_of_the_points_left_out_is_reported_beside():
    cameras, tables = _rig()
    for table in tables:
        table.loc[20, "x"] += 2.0
        table.loc[20, ["used", "reason"]] = [False, "misplaced"]
    record = back_project(cameras, tables, units="in").record
    held = record["held_out"]
    assert (held["n"], held["of_all"]["n"], held["of_all"]["points_left_out"]) == (63, 64, 1)
    assert held["max_3d"] < 0.5
    assert held["of_all"]["max_3d"] == pytest.approx(2.0, abs=0.3)
    assert "held-out-without-some" in {finding["code"] for finding in record["findings"]}


def test_what_a_board_says_of_the_cameras_is_left_out_of_no_fold():
    """Lenses and places to each other by a board, 14 surveyed points: without the board a fold's cameras are worse."""
    rng, truth, p = np.random.default_rng(4), thesis_rig(2), thesis_points()[1]
    known = [refine(c, p, project(c, p) + rng.normal(0, 0.02, (64, 2)), free=FREE) for c in truth]
    boards = {c.name: fit.camera for c, fit in zip(truth, known, strict=True)}
    covariance = np.zeros((2 * len(FREE),) * 2)
    for i, fit in enumerate(known):
        place = slice(i * len(FREE), (i + 1) * len(FREE))
        covariance[place, place] = fit.uncertainty.covariance
    tie = {"cameras": list(boards), "names": [FREE, FREE], "pivot": known[0].uncertainty.pivot.tolist()}
    tie |= {"covariance": covariance.tolist(), "scale_sd": 0.0}
    some = np.arange(64) % 5 == 1
    surveyed = p[some] + rng.normal(0, SIGMA, (some.sum(), 3))
    tables = []
    for camera in truth:
        table = _table(project(camera, p) + rng.normal(0, 0.1, (64, 2)))[some].reset_index(drop=True)
        table[["x", "y", "z"]] = surveyed
        tables.append(table)
    done = refine_together(
        truth, tables, free=[FREE, FREE], sigma=0.0, ties=[tie], boards=boards, alone=[None, None], lenses=[None, None]
    )
    how = {"refine": "full", "free": [FREE, FREE], "units": "in"}
    by_board = back_project(done.cameras, tables, ties=[tie], boards=boards, **how).record
    alone = back_project(done.cameras, tables, **how).record
    assert by_board["held_out"]["mean_3d"] < 0.85 * alone["held_out"]["mean_3d"]
    assert by_board["held_out"]["mean_3d"] > by_board["mean_3d"]
    q = rng.uniform([-27, -6, -9], [27, 6, 9], (400, 3))
    located = locate_points(done.cameras, [project(c, q) + rng.normal(0, 0.1, (400, 2)) for c in truth]).point
    new = np.linalg.norm(located - (q + rng.normal(0, SIGMA, q.shape)), axis=-1).mean()
    assert by_board["held_out"]["mean_3d"] == pytest.approx(new, rel=0.35), "as points that were never surveyed"


def test_a_stretched_axis_of_the_survey_stands_in_the_record():
    rng = np.random.default_rng(3)
    p = thesis_points()[1]
    b = [project(camera, p) + rng.normal(0, 0.1, (64, 2)) for camera in thesis_rig(2)]
    stated = p * [1.02, 1, 1]
    cameras = [refine(camera, stated, own, free=FREE).camera for camera, own in zip(thesis_rig(2), b, strict=True)]
    tables = [_table(own).assign(x=stated[:, 0]) for own in b]
    best = back_project(cameras, tables, units="in").record["stretches"][0]
    assert best["kind"] == "x"
    assert best["share"] == pytest.approx(0.02, abs=5 * best["sd"])
    cameras, tables = _rig()
    assert all(abs(own["share"]) < 4 * own["sd"] for own in back_project(cameras, tables).record["stretches"])

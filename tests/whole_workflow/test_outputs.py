"""What comes out of the small laboratory: the contract's files, columns and keys, right numbers, a page that opens."""

import json
import math
import shutil
import subprocess

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

COLUMNS = {
    "calibration/cam1/points.parquet": "tag x y z Xf Yf pixels frames sd_x sd_y used reason",
    "calibration/backprojection.parquet": "tag x y z x_located y_located z_located n_cameras Xf Yf Xf_projected "
    "Yf_projected Xf_no_distortion Yf_no_distortion Xf_from_located Yf_from_located",
    "runs/pluck/centroids/cam1.parquet": "frame field time_s timecode target Xf Yf pixels total_pixels box_x box_y "
    "box_w box_h flag",
    "runs/pluck/trajectories.parquet": "time_s timecode target x y z sigma_x sigma_y sigma_z miss n_cameras flag",
    "runs/pluck/kinematics.parquet": "time_s target x y z vx vy vz ax ay az",
}
KEYS = {
    "calibration/cam1/camera.json": "camera model units image_size Cx Cy dx dy Sx f kappa1 R T det_R n_points rms_px "
    "max_px standard_errors refine settings provenance",
    "calibration/backprojection.json": "mean_abs max_abs held_out provenance",
    "runs/pluck/comparison.json": "lag_s gain bias rms max_abs correlation n before after provenance",
}


@pytest.mark.parametrize("name", COLUMNS)
def test_tables_have_the_columns_of_the_contract_with_units_and_provenance(processed, name):
    schema = pq.read_schema(processed / "results" / name)
    assert set(COLUMNS[name].split()) <= set(schema.names)
    assert all(b"unit" in schema.field(column).metadata for column in schema.names)
    provenance = json.loads(schema.metadata[b"provenance"])
    assert {"vidtrack", "settings", "inputs"} <= set(provenance)
    assert all(len(checksum) == 64 for checksum in provenance["inputs"].values())


@pytest.mark.parametrize("name", KEYS)
def test_records_have_the_keys_of_the_contract(processed, name):
    record = json.loads((processed / "results" / name).read_text())
    assert set(KEYS[name].split()) <= set(record)


def test_every_deliverable_stands(processed):
    for name in ("report.html", "calibration/overlay_cam1.png", "runs/still/trajectories.csv"):
        assert (processed / "results" / name).stat().st_size > 100


def test_the_motion_is_found_to_a_hundredth_of_an_inch(processed):
    """Survey errors of 0.03 in on 36 points leave about 0.01 in (0.03 / sqrt(36 points) times the rig's geometry)."""
    truth = json.loads((processed / "results/runs/pluck/comparison.json").read_text())["truth"]
    assert 0.001 < truth["mean"] < 0.025


def test_the_sensors_lead_is_found(processed):
    record = json.loads((processed / "results/runs/pluck/comparison.json").read_text())
    assert record["lag_s"] == pytest.approx(0.2, abs=0.005)
    assert record["after"]["rms"] < 0.1 < record["before"]["rms"]


def test_camera_json_projects_the_points_where_they_were_seen(processed):
    """An independent reading of the contract's equations, from the JSON and the tables alone."""
    record = json.loads((processed / "results/calibration/cam1/camera.json").read_text())
    points = pd.read_parquet(processed / "results/calibration/cam1/points.parquet")
    points = points[points["used"]]
    errors = []
    for row in points.itertuples():
        x, y, z = np.array(record["R"]) @ [row.x, row.y, row.z] + record["T"]
        Xu, Yu = record["f"] * x / z, record["f"] * y / z
        Xd, Yd = Xu, Yu
        for _ in range(50):  # fixed point: slow, but nobody's library
            gain = 1 + record["kappa1"] * (Xd**2 + Yd**2)
            Xd, Yd = Xu / gain, Yu / gain
        Xf = record["Sx"] * Xd / record["dx"] + record["Cx"]
        Yf = Yd / record["dy"] + record["Cy"]
        errors.append((Xf - row.Xf) ** 2 + (Yf - row.Yf) ** 2)
    assert math.sqrt(np.mean(errors)) == pytest.approx(record["rms_px"], rel=1e-3)


def test_a_ball_that_is_plainly_to_be_seen_is_measured_in_every_sample(processed):
    for camera in ("cam1", "cam2"):
        table = pd.read_parquet(processed / f"results/runs/pluck/centroids/{camera}.parquet")
        assert table["Xf"].notna().all(), camera


def test_time_is_seconds_since_midnight_of_the_time_code(processed):
    table = pd.read_parquet(processed / "results/runs/pluck/centroids/cam1.parquet")
    first = table.iloc[0]
    assert first["timecode"] == "10:00:00:00"
    assert first["time_s"] == pytest.approx(36000.0, abs=1e-6)  # non-drop code is read as a clock, then true seconds


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium on this machine")
def test_each_page_opens_in_a_browser_and_needs_nothing_beside_it(processed, tmp_path):
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-quic"]
    command += ["--disable-background-networking", "--disable-component-update", "--disable-sync"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1200,5000", "--virtual-time-budget=5000"]
    pages = {"report.html": 'href="report/run_pluck.html"', "report/run_pluck.html": 'id="run-pluck"'}
    pages |= {"report/calibration.html": "<h2>Calibration</h2>"}
    for name, shown in pages.items():
        shutil.copy(processed / "results" / name, tmp_path / "alone.html")
        page = (tmp_path / "alone.html").as_uri()
        opened = subprocess.run([*command, "--dump-dom", page], capture_output=True, text=True, check=True, timeout=120)
        dom = opened.stdout
        assert shown in dom
        assert "http://" not in dom.replace("http://www.w3.org", "")
        assert "https://" not in dom
        pictures = dom.count("data:image/png"), dom.count("<svg")
        assert name == "report.html" or (pictures[0] >= 2 and sum(pictures) >= 5), pictures
    shot = tmp_path / "page.png"
    subprocess.run([*command, f"--screenshot={shot}", page], capture_output=True, check=True, timeout=120)
    import cv2

    picture = cv2.imread(str(shot))
    assert picture.shape[0] == 5000
    inked = (picture.min(axis=2) < 200).mean(axis=1) > 0
    assert inked[:3000].mean() > 0.3  # text and figures down the whole page

"""A board and nothing surveyed, from the recordings to trajectories (docs/boards.md), and a tag (docs/tags.md)."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation

from tests.discs import picture
from tests.whole_workflow.conftest import snakemake
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.board_picture import board_picture, drawing

SIZE = (480, 360)
SQUARE = 30.0
BOARD = {"type": "charuco", "columns": 8, "rows": 6, "square": SQUARE, "world": "board/0"}
PATH = np.stack([120 + 60 * np.sin(np.arange(5) / 3), np.full(5, 90.0), 30.0 + 5 * np.arange(5)], -1)
"""Where the ball is, in the world that the board of the first view makes."""
TURNS = [cv2.Rodrigues(np.array([0.5 + 0.2 * np.sin(k / 2), 0.3 * np.cos(k / 3), 0.1 * k]))[0] for k in range(6)]
PLACES = np.stack([100 + 60 * np.sin(np.arange(6) / 3), np.full(6, 90.0), 40.0 + 5 * np.arange(6)], -1)
"""How a tag of 60 mm stands, and where its centre is, in the same world."""
PAGE = Path(__file__).parents[2] / "docs/tags.md"


def cameras():
    turns = [cv2.Rodrigues(np.array([0.0, 0.4 * i, 0.0]))[0] for i in range(2)]
    places = [np.array([-400.0 * i, 0.0, 80.0 * i]) for i in range(2)]
    return {
        f"cam{i + 1}": Camera(238.3 + i, 181.2, 1, 1, 1.0, 520.0, -0.05 / 520**2, R, T, SIZE)
        for i, (R, T) in enumerate(zip(turns, places, strict=True))
    }


def save(path, image):
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), image)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """Nine views of the board by two cameras, and five pictures of a ball; no points.csv."""
    folder, rng = tmp_path_factory.mktemp("boards"), np.random.default_rng(3)
    bitmap, middle = drawing("charuco", 8, 6), np.array([120.0, 90.0, 0.0])
    for k in range(9):
        R = cv2.Rodrigues(rng.normal(0, 0.35, 3) if k else np.zeros(3))[0] @ np.diag([1.0, -1.0, -1.0])
        centre = rng.uniform([-40, -80, 560], [240, 80, 850]) if k else np.array([100.0, 0.0, 700.0])
        T = centre - R @ middle
        world = (R, T) if k == 0 else world  # noqa: F821
        for name, camera in cameras().items():
            save(folder / f"calibration/board/{name}/{k:03d}.png", board_picture(camera, R, T, bitmap, SQUARE, rng=rng))
    for k, p in enumerate(PATH):
        for name, camera in cameras().items():
            at = project(camera, world[0] @ p + world[1])
            save(folder / f"runs/swing/{name}/{k:03d}.png", picture(SIZE[::-1], [(*at, 6)], noise=2, rng=rng))
    bitmap, side = drawing("apriltag", 1, 1, first=7), 60 / 0.75
    for k, (turn, place) in enumerate(zip(TURNS, PLACES, strict=True)):
        R = world[0] @ turn
        T = world[0] @ place + world[1] - R @ np.array([side / 2, side / 2, 0.0])
        for name, camera in cameras().items():
            seen = board_picture(camera, R, T, bitmap, side, rng=rng)
            save(folder / f"runs/both/{name}/{k:03d}.png", seen)
            if name == "cam1":
                save(folder / f"runs/one/{name}/{k:03d}.png", seen)
    (folder / "calibration/board/board.yaml").write_text(yaml.safe_dump(BOARD))
    config = yaml.safe_load(re.search(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL)[1])
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    answer = snakemake(folder)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


def test_the_ball_is_where_it_was_in_the_board_s_world(laboratory):
    """Within 0.6 mm at 0.7 m: nine small pictures give f to about a thousandth."""
    found = pd.read_parquet(laboratory / "results/runs/swing/trajectories.parquet")[["x", "y", "z"]].to_numpy()
    assert np.abs(found - PATH).max() < 0.6


def test_each_camera_has_its_lens_its_place_and_how_well_they_are_known(laboratory):
    for name, camera in cameras().items():
        record = json.loads((laboratory / f"results/calibration/{name}/camera.json").read_text())
        assert record["f"] == pytest.approx(camera.f, rel=5e-3)
        assert record["Cx"] == pytest.approx(camera.Cx, abs=3)
        assert record["standard_errors"]["f"] > 0
        assert record["board"]["views"] == 9


def test_the_calibration_is_good_and_the_report_is_there(laboratory):
    verdict = json.loads((laboratory / "results/verdict.json").read_text())
    assert verdict["calibration"]["verdict"] in ("good", "doubtful")
    assert "board-views" in {note["code"] for note in verdict["calibration"]["notes"]}
    assert (laboratory / "results/report/calibration.html").stat().st_size > 10_000


@pytest.mark.parametrize(("run", "body", "offset", "cameras"), [("one", "tag7", 0.0, 1), ("both", "float", -10.0, 2)])
def test_a_coded_tag_has_its_six_degrees_of_freedom_from_one_camera_and_from_two(
    laboratory, run, body, offset, cameras
):
    """Within 4.5 sigma, and 0.5 mm and 0.3 degrees, of which nearly all is the calibration's by nine small pictures."""
    found = pd.read_parquet(laboratory / f"results/runs/{run}/bodies.parquet")
    assert found["body"].unique().tolist() == [body]
    assert (found["flag"] == "").all()
    assert (found["n_cameras"] == cameras).all()
    truth = PLACES + np.array([R @ [0, 0, offset] for R in TURNS])
    off = found[["x", "y", "z"]].to_numpy() - truth
    assert np.abs(off).max() < 0.5
    R = Rotation.from_quat(found[["qx", "qy", "qz", "qw"]].to_numpy())
    turned = (R * Rotation.from_matrix(TURNS).inv()).as_rotvec()
    assert np.degrees(np.abs(turned)).max() < 0.3
    sd = np.sqrt(np.array([np.diag(np.reshape(C, (6, 6))) for C in found["covariance"]]))
    assert (np.abs(np.concatenate([turned, off], -1)) < 4.5 * sd).all()


def test_the_tag_s_centre_is_a_target_and_its_corners_are_those_of_the_page(laboratory):
    for run in ("one", "both"):
        table = pd.read_parquet(laboratory / f"results/runs/{run}/trajectories.parquet")
        assert set(table["target"]) == {"tag7", *(f"tag7_{k}" for k in range(1, 5))}
        centre = table.loc[table["target"] == "tag7", ["x", "y", "z"]].to_numpy()
        assert np.abs(centre - PLACES).max() < 0.5
        assert (laboratory / f"results/report/run_{run}.html").stat().st_size > 10_000
    record = json.loads((laboratory / "results/runs/both/bodies.json").read_text())
    assert record["bodies"]["float"]["size"]["factor"] == pytest.approx(1.0, abs=1e-3)
    verdict = json.loads((laboratory / "results/verdict.json").read_text())
    codes = {found["code"] for run in ("one", "both") for found in verdict["runs"][run]["reasons"]}
    assert not {code for code in codes if "tag" in code or code.endswith("failed")}


SURVEYED = np.array(
    [[x, y, z] for x in (-150.0, 150.0) for y in (-100.0, 100.0) for z in (0.0, 180.0)]
    + [[0.0, 120, 60], [-120, 0, 90], [90, -60, 140], [30, 50, -60.0]]
)
SURVEY_WORLD = cv2.Rodrigues(np.array([2.2, 0.1, -0.2]))[0], np.array([-60.0, 0.0, 720.0])
"""Where the first camera of `cameras` sees the axes in which points are surveyed."""


def surveyed_rig():
    """Three cameras in the survey's world."""
    R, T = SURVEY_WORLD
    own = {name: c.with_(R=c.R @ R, T=c.R @ T + c.T) for name, c in cameras().items()}
    turn = cv2.Rodrigues(np.array([0.0, -0.45, 0.05]))[0]
    third = own["cam1"].with_(R=turn @ own["cam1"].R, T=turn @ own["cam1"].T + [300.0, 0, 100.0])
    return own | {"cam3": third}


@pytest.fixture(scope="module")
def beside_survey(tmp_path_factory):
    """A board of tags before two cameras, of which one sees surveyed points; a third sees points, but not the board."""
    folder, rng = tmp_path_factory.mktemp("tied"), np.random.default_rng(4)
    rig, bitmap, middle = surveyed_rig(), drawing("apriltag", 6, 4), np.array([90.0, 60.0, 0.0])
    for k in range(8):
        turn = cv2.Rodrigues(rng.normal(0, 0.4, 3))[0]
        R = SURVEY_WORLD[0].T @ turn @ np.diag([1.0, -1.0, -1.0])
        T = SURVEY_WORLD[0].T @ (rng.uniform([-40, -80, 450], [200, 80, 750]) - SURVEY_WORLD[1]) - R @ middle
        for name, camera in rig.items():
            seen = board_picture(camera, R, T, bitmap, SQUARE, rng=rng) if name != "cam3" else picture(SIZE[::-1], [])
            save(folder / f"calibration/board/{name}/{k:03d}.png", seen)
    for clip, name, kept in (("few", "cam1", range(6, 12)), ("front", "cam3", range(12))):
        save(folder / f"calibration/{clip}/{name}.png", picture(SIZE[::-1], [], noise=2, rng=rng))
        b = project(rig[name], SURVEYED) + rng.normal(0, 0.1, (len(SURVEYED), 2))
        lines = ["camera,tag,Xf,Yf,sd", *(f"{name},p{i},{b[i, 0]:.2f},{b[i, 1]:.2f},0.1" for i in kept)]
        (folder / f"calibration/{clip}/picks.csv").write_text("\n".join(lines) + "\n")
    survey = "\n".join(f"p{i},{x:g},{y:g},{z:g}" for i, (x, y, z) in enumerate(SURVEYED))
    (folder / "calibration/points.csv").write_text(f"tag,x,y,z\n{survey}\n")
    board = {"type": "apriltag", "columns": 6, "rows": 4, "square": SQUARE}
    (folder / "calibration/board/board.yaml").write_text(yaml.safe_dump(board))
    for k, p in enumerate(SWUNG):
        for name, camera in rig.items():
            at = project(camera, p)
            save(folder / f"runs/swing/{name}/{k:03d}.png", picture(SIZE[::-1], [(*at, 6)], noise=2, rng=rng))
    own = {name: {"rate": 30, "clock": {"offset_s": 0}} for name in rig}
    config = {"units": "mm", "cameras": own, "calibration": CALIBRATION, "runs": {"swing": {"targets": 1}}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    answer = snakemake(folder)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


CALIBRATION = {"sigma": 0.3, "clips": {"few": {"tags": [f"p{i}" for i in range(6, 12)]}}}
SWUNG = np.stack([40 * np.sin(np.arange(5) / 3), np.full(5, 20.0), 60.0 + 10 * np.arange(5)], -1)


def test_a_camera_without_surveyed_points_is_in_the_survey_s_world_by_the_board(beside_survey):
    """And the ball is where it was, within its sigma: the survey of six points is good to 0.3 mm."""
    for name, camera in surveyed_rig().items():
        record = json.loads((beside_survey / f"results/calibration/{name}/camera.json").read_text())
        off = np.abs(np.array(record["position"]) - camera.position)
        assert (off < 4.5 * np.array(record["position_sd"]) + 0.05).all(), (name, off, record["position_sd"])
        assert off.max() < 8
    found = pd.read_parquet(beside_survey / "results/runs/swing/trajectories.parquet")
    off = np.abs(found[["x", "y", "z"]].to_numpy() - SWUNG)
    assert off.max() < 1.5
    assert (off < 4.5 * found[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()).all()


def test_the_record_says_what_the_board_ties_and_the_verdict_which_camera_it_was_not_shown_to(beside_survey):
    record = json.loads((beside_survey / "results/calibration/cam2/camera.json").read_text())
    assert record["bundle"]["board"]["cameras"] == [["cam1", "cam2"]]
    assert record["bundle"]["board"]["sigma"] < 0.5
    verdict = json.loads((beside_survey / "results/verdict.json").read_text())["calibration"]
    lost = [found for found in [*verdict["reasons"], *verdict["notes"]] if found["code"] == "board-no-lens"]
    assert lost
    assert "cam3" in lost[0]["text"]
    assert (beside_survey / "results/report/calibration.html").stat().st_size > 10_000

"""Two cameras whose lenses are known, and five surveyed points picked by hand (docs/known-lens.md)."""

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml

from tests.discs import picture
from tests.whole_workflow.conftest import snakemake
from vidtrack.geometry.brown import BrownLens, distorted
from vidtrack.geometry.camera import project
from vidtrack.geometry.lens_conversion import camera_from_brown

SIZE = (640, 480)
PAGE = Path(__file__).parents[2] / "docs/known-lens.md"
POINTS = np.array([[0, 0, 0], [900, 50, 0], [850, 700, 30], [40, 680, 300], [450, 300, 420.0]])
PATH = np.stack([400 + 60 * np.sin(np.arange(5) / 3), np.full(5, 300.0), 150.0 + 20 * np.arange(5)], -1)
LENS = {
    "cam1": BrownLens(830.0, 829.0, 318.2, 240.9, SIZE, (-0.21, 0.06)),
    "cam2": BrownLens(800.0, 800.0, 319.5, 239.5, SIZE, (-0.12, 0.03)),
}
PLACE = {"cam1": (450.0, -1500.0, 900.0), "cam2": (-1000.0, -1100.0, 1000.0)}


def seen_by(name, p):
    """Where OpenCV's lens puts world points, px: not by the camera that vidtrack makes of it."""
    z = np.array([450.0, 350, 150]) - PLACE[name]
    z = z / np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1.0])
    x = x / np.linalg.norm(x)
    c = (np.asarray(p) - PLACE[name]) @ np.stack([x, np.cross(z, x), z]).T
    return distorted(LENS[name], c[..., :2] / c[..., 2:])


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """What the page says: lenses in a file and in config.yaml, picks by hand to 0.3 px, and a ball that moves."""
    folder, rng = tmp_path_factory.mktemp("known_lens"), np.random.default_rng(1)
    lines = ["camera,tag,Xf,Yf,sd"]
    for name in LENS:
        (folder / "calibration/front").mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(folder / f"calibration/front/{name}.png"), picture(SIZE[::-1], [], noise=2, rng=rng))
        b = seen_by(name, POINTS) + rng.normal(0, 0.3, (len(POINTS), 2))
        lines += [f"{name},{tag},{x:.2f},{y:.2f},0.3" for tag, (x, y) in zip("abcde", b, strict=True)]
        (folder / "runs/swing" / name).mkdir(parents=True)
        for k, p in enumerate(PATH):
            seen = picture(SIZE[::-1], [(*seen_by(name, p), 6)], noise=2, rng=rng)
            cv2.imwrite(str(folder / f"runs/swing/{name}/{k:03d}.png"), seen)
    (folder / "calibration/front/picks.csv").write_text("\n".join(lines) + "\n")
    survey = "\n".join(f"{tag},{x:g},{y:g},{z:g}" for tag, (x, y, z) in zip("abcde", POINTS, strict=True))
    (folder / "calibration/points.csv").write_text(f"tag,x,y,z\n{survey}\n")
    own = LENS["cam1"]
    storage = cv2.FileStorage(str(folder / "calibration/cam1.yml"), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", np.array([[own.fx, 0, own.cx], [0, own.fy, own.cy], [0, 0, 1.0]]))
    storage.write("distortion_coefficients", np.array([*own.k, own.p1, own.p2]))
    storage.write("image_width", SIZE[0])
    storage.write("image_height", SIZE[1])
    storage.release()
    config = yaml.safe_load(re.search(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL)[1])
    numbers = config["cameras"]["cam2"]["calibration"]["lens"]
    other = LENS["cam2"]
    numbers.update(fx=other.fx, cx=other.cx, cy=other.cy, k1=other.k[0], k2=other.k[1])
    config["units"] = "mm"
    config["calibration"] = {"sigma": 1.0}
    for camera in config["cameras"].values():
        camera |= {"rate": 30, "clock": {"offset_s": 0}}
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    answer = snakemake(folder, "results/runs/swing/trajectories.parquet")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


def test_five_points_place_each_camera_within_its_sigma(laboratory):
    for name in LENS:
        record = json.loads((laboratory / f"results/calibration/{name}/camera.json").read_text())
        off = np.array(record["position"]) - PLACE[name]
        assert (np.abs(off) < 4 * np.array(record["position_sd"]) + 0.5).all()
        assert np.linalg.norm(off) < 10
        assert record["n_points"] == 5


def test_the_ball_is_located_with_an_honest_sigma(laboratory):
    found = pd.read_parquet(laboratory / "results/runs/swing/trajectories.parquet")
    off = found[["x", "y", "z"]].to_numpy() - PATH
    assert np.abs(off).max() < 3
    assert (np.abs(off) < 4.5 * found[["sigma_x", "sigma_y", "sigma_z"]].to_numpy()).all()


def test_the_report_says_how_far_the_converted_lens_is_off(laboratory):
    record = json.loads((laboratory / "results/calibration/cam1/camera.json").read_text())
    converted = camera_from_brown(LENS["cam1"])
    assert record["lens"]["largest_px"] == pytest.approx(converted.largest_px, abs=1e-6)
    assert project(converted.camera, [[0.0, 0, 1]]).shape == (1, 2)

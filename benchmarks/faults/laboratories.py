"""Experiments as small as they can be, which together have a job of every rule."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from tests.discs import picture
from tests.exchange.thesis.folder import write_old
from vidtrack.command import main as vidtrack
from vidtrack.geometry.camera import Camera, line_of_sight, project
from vidtrack.simulate.board_picture import board_picture, drawing
from vidtrack.simulate.laboratory import set_up
from vidtrack.simulate.scenario import camera_from_plan, scenario_from

SIZE = (240, 180)


def _rig(seed: int, **more: Any) -> dict[str, Any]:
    cameras = {
        name: {"pan_deg": pan, "tilt_deg": 40, "distance": 120, "size": list(SIZE), "sensor": [6.4, 4.8], "field": 60}
        | {"Sx": 1.003, "kappa1": 6e-4, "centre": centre}
        for name, pan, centre in (("cam1", -130, [121.0, 88.0]), ("cam2", -50, [117.5, 91.0]))
    }
    return {
        "seed": seed,
        "units": "in",
        "cameras": cameras,
        "picture": {"background": 24, "contrast": 180, "noise": 2, "blur_px": 0.5},
        "recording": {"rate": 30, "tape": {"codec": "ffv1", "container": "mkv"}},
        "calibration": {
            "points": {"rows": 3, "wires": 4, "balls": 3, "spacing": [10, 9, 8]},
            "diameter": 1.6,
            "frames": 1,
            "survey": {"error": 0.02},
            "clips": {
                "front": {"tags": "1-12", "picks": "1, 3, 5, 8, 10, 12"},
                "middle": {"tags": "13-24"},
                "rear": {"tags": "25-36"},
            },
        },
        **more,
    }


CLIPS = {"front": {"tags": "1-12"}, "middle": {"tags": "13-24"}, "rear": {"tags": "25-36"}}
SWING = {"oscillations": [{"along": [1, 0, 0], "amplitude": 8, "hz": 1.1}]}
BALL = {"diameter": 1.6, "motion": {"at": [0, 0, 2], **SWING}}


def small_scenario() -> dict[str, Any]:
    """Two cameras, three clips of one picture, a run of half a second beside a sensor's record."""
    run = {"start": "10:00:00:00", "duration_s": 0.5, "targets": {"t1": BALL}}
    run["reference"] = {"target": "t1", "column": "x_in", "rate": 30, "error": 0.06}
    return _rig(3, runs={"swing": run})


def plain(folder: Path) -> None:
    """`small_scenario`, rendered."""
    set_up(scenario_from(small_scenario(), "scenario"), str(folder), threads=1)
    config = {"units": "in", "cameras": {"cam1": {"sensor": [6.4, 4.8]}, "cam2": {"sensor": [6.4, 4.8]}}}
    config |= {"calibration": {"clips": CLIPS}, "runs": {"swing": {"targets": 1, "reference": {"value": "x_in"}}}}
    _configure(folder, config)


def whole(folder: Path) -> None:
    """As `plain`, with a body, by which cameras are refined, and its analysis, the water's edge, clips from after the
    test, a rig on paper, a campaign, exports, films and all pages in one file.
    """
    body = {"a": [5, 0, 0], "b": [-5, 4, 0], "c": [-5, -4, 1]}
    targets = {n: {"diameter": 1.6, "motion": {"at": [0, 0, 2], "arm": arm, **SWING}} for n, arm in body.items()}
    runs = {
        "float": {"start": "10:00:00:00", "duration_s": 1.5, "boxes": True, "targets": targets},
        "swing": {"start": "10:01:00:00", "duration_s": 0.6, "targets": {"t1": BALL}},
    }
    runs["swing"]["reference"] = {"target": "t1", "column": "x_in", "rate": 30, "error": 0.06}
    rig = _rig(4, runs=runs)
    scenario = scenario_from(rig, "scenario")
    set_up(scenario, str(folder), threads=1)
    clips = dict(CLIPS)
    for name in CLIPS:
        shutil.copytree(folder / "calibration" / name, folder / "calibration" / f"{name}2")
        clips[f"{name}2"] = CLIPS[name]
    (folder / "runs/beach").mkdir()
    _film_a_beach(folder / "runs/beach/cam1.mkv", camera_from_plan(scenario.cameras["cam1"], "cam1"))
    (folder / "runs.csv").write_text("run,H,T,notes\nfloat,0.1,1.2,calm\nswing,0.2,1.5,\n")
    t = np.arange(0, 1.5, 0.02)
    record = "".join(f"{at:.2f},{np.sin(6 * at):.5f}\n" for at in t)
    (folder / "runs/float/daq.csv").write_text("time_s,eta\n" + record)
    _plan(folder / "sensitivity/rig.yaml")
    beach = {"mode": "waterline", "waterline": {"transects": {"middle": {"from": [-9, 0, 0], "to": [9, 0, 0]}}}}
    config = {
        "units": "in",
        "cameras": {"cam1": {"sensor": [6.4, 4.8]}, "cam2": {"sensor": [6.4, 4.8], "clock": "auto"}},
        "calibration": {"refine": "bundle", "clips": clips, "after": [f"{name}2" for name in CLIPS]}
        | {"self": {"body": "buoy", "runs": ["float"], "sigma": 0.005}},
        "axes": {"waves": "+x", "up": "+z"},
        "export": ["csv", "c3d", "netcdf"],
        "report": {"overlay": True, "one_file": True},
        "runs": {
            "float": {
                "bodies": {"buoy": body},
                "channels": {"file": "daq.csv", "columns": ["eta"], "offset_s": 36000.0},
                "analysis": {"waves": {"elevation": "eta"}},
            },
            "swing": {"targets": 1, "reference": {"value": "x_in"}},
            "beach": beach,
        },
    }
    _configure(folder, config)


def board(folder: Path) -> None:
    """A board and nothing surveyed: nine views of it, five pictures of a ball, and four of a coded tag on a body."""
    rng, square, bitmap = np.random.default_rng(3), 30.0, drawing("charuco", 8, 6)
    size, middle = (480, 360), np.array([120.0, 90.0, 0.0])
    cameras = {}
    for i in range(2):
        R, T = cv2.Rodrigues(np.array([0.0, 0.4 * i, 0.0]))[0], np.array([-400.0 * i, 0.0, 80.0 * i])
        cameras[f"cam{i + 1}"] = Camera(238.3 + i, 181.2, 1, 1, 1.0, 520.0, -0.05 / 520**2, R, T, size)
    world = np.eye(3), np.zeros(3)
    for k in range(9):
        R = cv2.Rodrigues(rng.normal(0, 0.35, 3) if k else np.zeros(3))[0] @ np.diag([1.0, -1.0, -1.0])
        centre = rng.uniform([-40, -80, 560], [240, 80, 850]) if k else np.array([100.0, 0.0, 700.0])
        T = centre - R @ middle
        world = world if k else (R, T)
        for name, camera in cameras.items():
            image = board_picture(camera, R, T, bitmap, square, rng=rng)
            _save(folder / f"calibration/board/{name}/{k:03d}.png", image)
    for k in range(5):
        p = np.array([120 + 10.0 * k, 90.0, 30.0])
        for name, camera in cameras.items():
            at = project(camera, world[0] @ p + world[1])
            image = picture(size[::-1], [(*at, 6)], noise=2, rng=rng)
            _save(folder / f"runs/swing/{name}/{k:03d}.png", image)
    bitmap, side = drawing("apriltag", 1, 1, first=7), 60 / 0.75
    for k in range(4):
        R = world[0] @ cv2.Rodrigues(np.array([0.5 + 0.1 * k, 0.3, 0.1 * k]))[0]
        T = world[0] @ np.array([100.0 + 15 * k, 90.0, 40.0]) + world[1] - R @ np.array([side / 2, side / 2, 0.0])
        for name, camera in cameras.items():
            _save(folder / f"runs/tagged/{name}/{k:03d}.png", board_picture(camera, R, T, bitmap, side, rng=rng))
    described = {"type": "charuco", "columns": 8, "rows": 6, "square": square, "world": "board/0"}
    (folder / "calibration/board/board.yaml").write_text(yaml.safe_dump(described))
    tagged = {"tags": {"family": "36h11", "size": 60}, "bodies": {"float": {"tags": {7: {"centre": [0, 0, 10]}}}}}
    config = {"units": "mm", "cameras": {name: {"rate": 30, "clock": {"offset_s": 0}} for name in cameras}}
    _configure(folder, config | {"runs": {"swing": {}, "tagged": tagged}})


def wand(folder: Path) -> None:
    """A wand that is waved, and no surveyed point."""
    scene = yaml.safe_load((Path(__file__).resolve().parents[2] / "data/wand.yaml").read_text())
    scene["runs"]["swing"]["duration_s"] = 0.5
    set_up(scenario_from(scene, "scenario"), str(folder), threads=1)
    waved = {"lengths": {"A-B": 20.0}, "sigma": 0.01}
    waved["axes"] = {"origin": "bob", "up": ["bob", "hook"], "x": ["left", "right"]}
    config = {"units": "in", "cameras": {"cam1": {"sensor": [8.8, 6.6]}, "cam2": {"sensor": [8.8, 6.6]}}}
    _configure(folder, config | {"calibration": {"wand": waved}, "runs": {"swing": {"targets": 1}}})


def old(folder: Path) -> None:
    """The thesis's files with its calibration."""
    _imported(folder, "old")


def old_points(folder: Path) -> None:
    """The thesis's tracks and points, calibrated anew."""
    _imported(folder, "points")


def _imported(folder: Path, calibration: str) -> None:
    room = folder.with_name(f"{folder.name}-old")
    room.mkdir()
    write_old(room)
    how = ["--units", "in", "--calibration", calibration, "--run", "pluck"]
    if vidtrack(["import", str(room), str(folder), *how]):
        raise SystemExit("the old files could not be imported")
    shutil.rmtree(room)


def _configure(folder: Path, config: dict[str, Any]) -> None:
    (folder / "config.yaml").write_text(yaml.safe_dump(config, sort_keys=False))


def _save(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), image)


def _film_a_beach(path: Path, camera: Camera) -> None:
    """Dark water up to an edge that moves on the plane z = 0, bright sand beyond."""
    import av

    rng, (width, height) = np.random.default_rng(5), camera.image_size
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1)
    origin, direction = line_of_sight(camera, grid)
    x = origin[0] - direction[..., 0] * origin[2] / direction[..., 2]
    with av.open(str(path), "w") as out:
        stream = out.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = width, height, "gray"
        for i in range(15):
            edge = 4 * np.sin(7 * i / 30)
            grey = 60 + 110 / (1 + np.exp(-(x - edge).clip(-50, 50) / 0.15)) + rng.normal(0, 3, x.shape)
            out.mux(stream.encode(av.VideoFrame.from_ndarray(grey.clip(0, 255).astype(np.uint8), "gray")))
        out.mux(stream.encode())


def _plan(path: Path) -> None:
    cameras = {
        n: {"pan_deg": p, "tilt_deg": 45, "distance": 160, "sensor": [8.8, 6.6], "field": 128}
        for n, p in (("a", -45), ("b", 45))
    }
    rig = {"units": "in", "cameras": cameras, "calibration": {"points": {"spacing": [18, 4, 6]}}, "trials": 0}
    rig |= {"light": {"centroid_px": 0.1}, "sweeps": {"light.centroid_px": [0.1, 0.2]}}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(rig))


LABORATORIES: dict[str, Callable[[Path], None]] = {
    "plain": plain,
    "whole": whole,
    "board": board,
    "wand": wand,
    "old": old,
    "old_points": old_points,
}

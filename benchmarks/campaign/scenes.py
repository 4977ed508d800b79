"""Random laboratories: rigs, lenses, surveys, targets; small pictures and short runs, so that hundreds can be made."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.motion import position
from vidtrack.simulate.scenario import camera_from_plan, scenario_from

SIZE = (384, 288)
SENSOR = (6.4, 4.8)
RATE = 30
DURATION_S = 2.0
APART = 0.5
"""Diameters between the edges of two targets in every view, at least: where they touch is a circumstance of its own."""

LIT_FROM_ONE_SIDE = 0.5
"""Share of the experiments in which a lamp lights the balls; in half of these the run has another than the clips."""


def random_scene(rng: np.random.Generator) -> dict[str, Any]:
    """A scenario as `vidtrack.simulate` reads it: nothing is wrong with it."""
    n_cameras = int(rng.choice([2, 2, 2, 3, 4]))
    # a row of balls is seen from before or from behind, never along it, where balls hide each other
    spread = rng.uniform(30, 50)
    bearings = np.array([-90 - spread, -90 + spread, 90 - spread, 90 + spread])[:n_cameras] + rng.uniform(
        -8, 8, n_cameras
    )
    cameras = {}
    for k, pan in enumerate(bearings):
        cameras[f"cam{k + 1}"] = {
            "pan_deg": float(pan),
            "tilt_deg": float(rng.uniform(25, 50)),
            "roll_deg": float(rng.normal(0, 1)),
            "target": [float(v) for v in rng.normal(0, 1.0, 3)],
            "distance": float(rng.uniform(110, 160)),
            "size": list(SIZE),
            "sensor": list(SENSOR),
            "field": float(rng.uniform(62, 72)),
            "Sx": float(rng.uniform(0.995, 1.01)),
            "kappa1": float(rng.uniform(-5e-4, 2e-3)),
            "centre": [float((SIZE[0] - 1) / 2 + rng.normal(0, 4)), float((SIZE[1] - 1) / 2 + rng.normal(0, 4))],
        }
    n_targets = int(rng.choice([1, 1, 2, 3]))
    error = float(rng.choice([0.0, 0.01, 0.03]))
    scene = {
        "seed": int(rng.integers(1, 2**31)),
        "units": "in",
        "cameras": cameras,
        "picture": {
            "background": float(rng.uniform(16, 45)),
            "contrast": float(rng.uniform(110, 190)),
            "noise": float(rng.uniform(1, 4)),
            "blur_px": 0.6,
        },
        "recording": {"rate": str(RATE), "tape": {"codec": "mjpeg", "container": "mov", "options": {"qscale": 2}}},
        "calibration": {
            "points": {"rows": 3, "wires": 4, "balls": 3, "spacing": [10, 9, 8]},
            "diameter": 1.6,
            "frames": 3,
            "survey": {"error": error, "distribution": "normal"},
            "clips": {
                "front": {"tags": "1-12", "picks": "1, 3, 5, 8, 10, 12"},
                "middle": {"tags": "13-24"},
                "rear": {"tags": "25-36"},
            },
        },
        "runs": {"test": run_of(rng, n_targets)},
    }
    while gap_of(scene) < APART:
        scene["runs"]["test"] = run_of(rng, n_targets)
    if rng.random() < LIT_FROM_ONE_SIDE:
        scene["lamp"] = lamp_of(rng)
        if rng.random() < 0.5:
            scene["runs"]["test"]["lamp"] = lamp_of(rng)
    return scene


def lamp_of(rng: np.random.Generator) -> dict[str, Any]:
    """A lamp at any side, above or a little below."""
    bearing, height = rng.uniform(0, 2 * np.pi), rng.uniform(-0.2, 1.2)
    return {"toward": [float(np.cos(bearing)), float(np.sin(bearing)), height], "share": float(rng.uniform(0.3, 0.9))}


def gap_of(scene: dict[str, Any]) -> float:
    """How near two targets come to each other in any view, edge to edge over the diameter; inf for one target."""
    plan = scenario_from(scene, "scenario")
    targets = list(plan.runs["test"].targets.values())
    times = np.linspace(0, DURATION_S, int(DURATION_S * RATE * 2))
    paths = [position(target.motion, times) for target in targets]
    gap = np.inf
    for name in plan.cameras:
        camera = camera_from_plan(plan.cameras[name], name)
        seen = [project(camera, path) for path in paths]
        px = [target.diameter / path_px for target, path_px in zip(targets, _world_per_px(camera, paths), strict=True)]
        for i, j in combinations(range(len(targets)), 2):
            size = (px[i] + px[j]) / 2
            gap = min(gap, float(((np.linalg.norm(seen[i] - seen[j], axis=-1) - size) / size).min()))
    return gap


def _world_per_px(camera: Camera, paths: list[Array]) -> list[Array]:
    """World units a pixel along paths (m, 3): distance from the camera over f in pixels."""
    return [np.linalg.norm(path - camera.position, axis=-1) / (camera.f / camera.dx) for path in paths]


def run_of(rng: np.random.Generator, n_targets: int) -> dict[str, Any]:
    """Targets that swing about places apart from each other."""
    return {
        "start": "10:00:00:00",
        "duration_s": DURATION_S,
        "boxes": bool(rng.random() < 0.5),
        "targets": {f"t{k + 1}": {"diameter": 1.6, "motion": motion_of(rng, k, n_targets)} for k in range(n_targets)},
    }


def motion_of(rng: np.random.Generator, k: int, n_targets: int) -> dict[str, Any]:
    """One target's swing; targets keep more than two diameters from each other."""
    place = [0.0, (k - (n_targets - 1) / 2) * 8.0, float(rng.uniform(-4, 4))]
    along = [1.0, float(rng.normal(0, 0.1)), float(rng.normal(0, 0.3))]
    return {
        "at": place,
        "oscillations": [
            {"along": along, "amplitude": float(rng.uniform(4, 10)), "hz": float(rng.uniform(0.4, 1.1))}
            | {"phase_deg": float(rng.uniform(0, 360))},
            {"along": [0, 0, 1], "amplitude": float(rng.uniform(0, 2)), "hz": float(rng.uniform(0.5, 1.5))},
        ],
    }

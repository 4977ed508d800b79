"""How often a stretched axis of the survey is said, and how often one is said that is not there.

    python benchmarks/survey_stretch.py --seed 1 --rigs 300

Random rigs of the campaign, without films: points of 36 balls (or 108) with centroid noise of 0.02 to 0.3 px and survey
errors, each camera refined alone as the workflow does, one axis surveyed too long by 0, 0.5, 1, 2 and 5 %. Square
pixels are exact in half of the rigs; in the other half Sx is off by up to 1 %, as the campaign has it. Printed: how
many are reported, and how many of those name the axis.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks.campaign.scenes import random_scene
from vidtrack.arrays import Array
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.surveys.survey_stretch import Stretch, stretches
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.scenario import camera_from_plan, scenario_from
from vidtrack.verdict.calibration_rules import stretch_findings

SHARES = (0.0, 0.005, 0.01, 0.02, 0.05)


def rig(rng: np.random.Generator) -> tuple[list[Camera], Array, dict[str, Any]]:
    """Cameras, points, and how they are measured."""
    plan = scenario_from(random_scene(rng), "scenario")
    square = bool(rng.random() < 0.5)
    cameras = [camera_from_plan(own, name) for name, own in plan.cameras.items()]
    if square:
        cameras = [camera.with_(Sx=1.0) for camera in cameras]
    layers = (3, 4, 3) if rng.random() < 0.5 else (4, 9, 3)
    axes = [np.linspace(-1, 1, k) * reach for k, reach in zip(layers, (15, 13, 8), strict=True)]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return cameras, p, {
        "noise": float(rng.choice([0.02, 0.05, 0.1, 0.3])),
        "survey": float(rng.choice([0.0, 0.01, 0.03])),
        "stated": bool(rng.random() < 0.7),
        "square": square,
        "points": len(p),
        "m": len(cameras),
    }  # fmt: skip


def judged(
    cameras: list[Camera], p: Array, how: dict[str, Any], deform: Array, rng: np.random.Generator
) -> list[Stretch]:
    """The stretches that a calibration shows whose survey is deformed."""
    surveyed = p @ deform.T + rng.normal(0, how["survey"], p.shape)
    b = np.stack([project(camera, p) for camera in cameras]) + rng.normal(0, how["noise"], (len(cameras), len(p), 2))
    sigma = np.full(len(p), how["survey"] if how["stated"] else 0.0)
    free = [free_parameters("tsai")] * len(cameras)
    fitted = [
        refine(camera, surveyed, own, free=names, sd=how["noise"], survey=sigma, tolerance=1e-8).camera
        for camera, own, names in zip(cameras, b, free, strict=True)
    ]
    sd = float("nan")
    if sigma.any():
        sd = bundle(fitted, surveyed, b, sigma=sigma, free=free).sigma_px
    return stretches(fitted, surveyed, b, free, [{}] * len(cameras), sigma=sigma, sd=sd)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rigs", type=int, default=300)
    parser.add_argument("--good", action="store_true", help="undeformed surveys alone")
    options = parser.parse_args()
    rows, worst = [], []
    for k in range(options.rigs):
        rng = np.random.default_rng([options.seed, k])
        cameras, p, how = rig(rng)
        for share in SHARES[:1] if options.good else SHARES:
            axis = int(rng.integers(3))
            deform = np.eye(3)
            deform[axis, axis] += share
            found = judged(cameras, p, how, deform, rng)
            said = stretch_findings({"stretches": [each._asdict() for each in found]})
            names = said[0].text if said else ""
            rows.append((share, "xyz"[axis], how["square"], how["noise"], bool(said), f"{'xyz'[axis]} is" in names))
            if share == 0 and found:
                worst.append(found[0].share / found[0].sd)
    good = np.abs(worst)
    print(f"{len(good)} good: largest departures, sd: {np.round(np.sort(good)[::-1][:8], 2)}")
    for square in (True, False):
        for share in SHARES:
            for axis in "xyz":
                own = [r for r in rows if r[0] == share and r[1] == axis and r[2] == square]
                if own:
                    by = {q: [r for r in own if r[3] == q] for q in sorted({r[3] for r in own})}
                    part = ", ".join(f"{q} px {sum(r[4] for r in o)}/{len(o)}" for q, o in by.items())
                    print(f"Sx {'exact' if square else 'off  '} {axis} {share:5.1%}: said {sum(r[4] for r in own)} of "
                          f"{len(own)}, axis named {sum(r[5] for r in own)} ({part})")  # fmt: skip


if __name__ == "__main__":
    main()

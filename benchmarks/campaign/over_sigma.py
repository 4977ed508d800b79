"""Errors over sigma of unspoiled random experiments that a lamp lights: how many lie beyond 2 to 5.

    python -m benchmarks.campaign.over_sigma --seed 8800 --count 33

The campaign counts what is 5 sigma off, once in 10,000 samples. How wide errors spread about their sigma shows sooner
whether sigma is honest: of positions, of centroids in runs, and of the calibration balls; all by the true cameras.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.campaign.__main__ import START_S
from benchmarks.campaign.one_process import process
from benchmarks.campaign.scenes import random_scene
from vidtrack.arrays import Array
from vidtrack.geometry.camera import project
from vidtrack.simulate.laboratory import set_up
from vidtrack.simulate.motion import position
from vidtrack.simulate.scenario import Scenario, camera_from_plan, scenario_from


def over_sigma(scene: dict[str, Any], folder: Path) -> dict[str, Array]:
    """Errors over their sd: positions (n, 3), centroids (n, 2), calibration balls (n, 2)."""
    plan = scenario_from(scene, "scenario")
    set_up(plan, str(folder), threads=1)
    (folder / "runs/test/truth.csv").unlink()
    process(folder)
    found: dict[str, list[Array]] = {"positions": [], "centroids": [], "calibration balls": []}
    points = pd.read_csv(folder / "truth/points.csv", dtype={"tag": str}).set_index("tag")
    for name in plan.cameras:
        camera = camera_from_plan(plan.cameras[name], name)
        seen = pd.read_parquet(folder / f"results/calibration/{name}/sightings.parquet")
        true = project(camera, points.loc[seen["tag"].astype(str), list("xyz")].to_numpy())
        found["calibration balls"].append(_over(seen, ["Xf", "Yf"], ["sd_x", "sd_y"], [true]))
        table = pd.read_parquet(folder / f"results/runs/test/centroids/{name}.parquet")
        for _, own in table.groupby("target", observed=True):
            paths = [project(camera, path) for path in _paths(plan, own)]
            found["centroids"].append(_over(own, ["Xf", "Yf"], ["sd_x", "sd_y"], paths))
    table = pd.read_parquet(folder / "results/runs/test/trajectories.parquet")
    for _, own in table.groupby("target", observed=True):
        found["positions"].append(_over(own, list("xyz"), ["sigma_x", "sigma_y", "sigma_z"], _paths(plan, own)))
    return {what: np.concatenate(parts) for what, parts in found.items() if parts}


def _paths(plan: Scenario, table: pd.DataFrame) -> list[Array]:
    moment = table["time_s"].to_numpy() - START_S
    return [position(target.motion, moment) for target in plan.runs["test"].targets.values()]


def _over(table: pd.DataFrame, what: list[str], sd: list[str], truths: list[Array]) -> Array:
    """Errors over sd of the rows with an empty flag, by the truth that is nearest."""
    errors = [table[what].to_numpy(float) - truth for truth in truths]
    error = min(errors, key=lambda one: float(np.nanmedian(np.abs(one))))
    z = error / table[sd].to_numpy(float)
    plain = table["flag"].fillna("") == "" if "flag" in table else np.ones(len(table), bool)
    return np.asarray(z[np.asarray(plain) & np.isfinite(z).all(axis=1)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=33, help="experiments")
    given = parser.parse_args()
    every: dict[str, list[Array]] = {}
    number = done = 0
    while done < given.count:
        scene = random_scene(np.random.default_rng([given.seed, number]))
        number += 1
        if "lamp" not in scene:
            continue
        done += 1
        with tempfile.TemporaryDirectory() as room:
            for what, z in over_sigma(scene, Path(room) / "experiment").items():
                every.setdefault(what, []).append(z.ravel())
    for what, parts in every.items():
        z = np.abs(np.concatenate(parts))
        beyond = ", ".join(f"{(z > k).mean():.3%}" for k in (2, 3, 4, 5))
        print(f"{what:17} {z.size:6}: rms {np.sqrt((z**2).mean()):.2f}; beyond 2, 3, 4, 5: {beyond}")


if __name__ == "__main__":
    main()

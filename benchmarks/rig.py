"""How well the whole workflow locates targets: the thesis's rig, filmed and compared with truth.

    python benchmarks/rig.py FOLDER [--seed 1991] [--cores 1] [--survey 0.03125] [--draws 20]

Films the demo's rig with two more cameras into FOLDER (what stands there already is not made again), runs snakemake
on it and locates its runs with two, three and four of the cameras: the demo's pluck; a ball that cam1 does not see for
a second; two balls of which one passes before the other in cam1. Errors are printed in in and as a share of the
diagonal field, z^2 is the square of an error over its sigma. The limit is a mean error of 1/40,000.

That of the pluck is taken apart: what the true cameras make of the same centroids, what the found cameras make of
exact ones, and the floor, which is what the true cameras make of noise with the scatter that the centroids have.

--survey is the standard deviation of each coordinate of the survey (in, default 0: exact), a draw of the seed. One draw
moves the whole run, so that its error says little of the next: --draws calibrates the same sightings by so many further
surveys, and locates the run with each. Beside the mean of these stands that of cameras fitted by maximum likelihood to
the same sightings and surveys, from the true cameras on, with the true lens model, noise and tolerance: no calibration
that knows the survey alone is better on average.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import yaml

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.files.camera_json import Calibrated, read_camera
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.scenario import scenario_from
from vidtrack.stages.calibrate import calibrate
from vidtrack.stages.locate import locate
from vidtrack.timing.resample import resample

REPO = Path(__file__).parents[1]
CAMERAS = ("cam1", "cam2", "cam3", "cam4")
OTHERS = {  # as vidtrack.simulate.rig.thesis_rig has them
    "cam3": {"pan_deg": -134, "tilt_deg": 45.5, "roll_deg": 0.4, "target": [0.2, -0.7, 0.3]}
    | {"f": 10.98, "Sx": 1.018, "kappa1": 7e-4, "centre": [262.1, 246.2]},
    "cam4": {"pan_deg": 136, "tilt_deg": 45, "roll_deg": -0.5, "target": [-0.4, 0.2, -0.6]}
    | {"f": 10.9, "Sx": 1.012, "kappa1": 5e-4, "centre": [249.4, 228.9]},
}
HIDDEN = (1.5, 2.5)
"""s, while cam1 does not see the target of the run `lost`."""


def laboratory(seed: int, survey: float) -> dict[str, Any]:
    """The demo's scenario with four cameras, a survey with errors of that standard deviation, in, and three runs."""
    plan: dict[str, Any] = yaml.safe_load((REPO / "data/demo.yaml").read_text())
    plan["seed"] = seed
    plan["cameras"] |= {
        name: {"distance": 160, "size": [512, 480], "sensor": [8.8, 6.6], **own} for name, own in OTHERS.items()
    }
    plan["calibration"]["survey"] = {"error": survey, "distribution": "normal"}
    pluck, forced = plan["runs"]["pluck"], plan["runs"]["forced"]
    lost = {**forced, "duration_s": 4, "first_frame": {}}
    lost["hidden"] = [{"camera": "cam1", "target": "t1", "from_s": HIDDEN[0], "to_s": HIDDEN[1]}]
    # midway the near ball stands 9 in before the far one on the axis of cam1, and to either side of it for the others
    pass_by = {"along": [1, 1, 0], "amplitude": 10, "hz": 0.25}
    far = {"at": [2.25, -2.25, -3.2], "oscillations": [pass_by]}
    near = {"at": [-2.25, 2.25, 3.2], "oscillations": [{**pass_by, "amplitude": -10}]}
    crossing = {"start": "10:40:00;00", "duration_s": 3, "targets": {"t1": {"motion": far}, "t2": {"motion": near}}}
    plan["runs"] = {"pluck": pluck, "lost": lost, "crossing": crossing}
    for run in plan["runs"].values():
        run.pop("reference", None)
    return plan


def make(folder: Path, plan: dict[str, Any], cores: int) -> None:
    """The experiment in `folder`, simulated and processed."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    scenario = folder.with_suffix(".yaml")
    if not (folder / "config.yaml").exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        scenario.write_text(yaml.safe_dump(plan))
        command = [sys.executable, "-m", "vidtrack.simulate", str(scenario), str(folder), "--threads", str(cores)]
        subprocess.run(command, check=True, cwd=REPO)
    elif yaml.safe_load(scenario.read_text()) != plan:
        sys.exit(f"{folder} was made with another seed or survey. Give another folder.")
    command = [sys.executable, "-m", "snakemake", "-s", str(REPO / "Snakefile"), "--directory", str(folder)]
    done = subprocess.run(
        [*command, "--cores", str(cores)], capture_output=True, text=True, env=environment, check=False
    )
    if done.returncode:
        sys.exit(done.stdout + done.stderr)


class Rig(NamedTuple):
    """Some of the cameras, as they are and as they were found, and the field by which errors are judged."""

    true: dict[str, Camera]
    found: dict[str, Calibrated]
    points: dict[str, pd.DataFrame]
    field: float


def rig_of(folder: Path, names: tuple[str, ...]) -> Rig:
    true = read_json(folder / "truth/cameras.json")
    calibration = folder / "results/calibration"
    field = read_json(calibration / "backprojection.json")["diagonal_field"]
    return Rig(
        {name: Camera(**true[name]) for name in names},
        {name: read_camera(calibration / name / "camera.json") for name in names},
        {name: read_parquet(calibration / name / "points.parquet") for name in names},
        field,
    )


class Held(NamedTuple):
    """The trajectories of a run against the truth."""

    mean: float
    rms: float
    largest: float
    bias: float
    normalised: float
    n: int

    def line(self, field: float) -> str:
        sizes = f"{self.mean:>8.5f} {field / self.mean:>9.0f} {self.rms:>8.5f} {self.largest:>8.5f} {self.bias:>8.5f}"
        return f"{sizes} {self.normalised:>6.2f} {self.n:>4}"


HEAD = f"{'':38} {'mean in':>8} {'field/mean':>9} {'rms':>8} {'largest':>8} {'bias':>8} {'z^2':>6} {'n':>4}"


def held(error: np.ndarray, sigma: np.ndarray) -> Held:
    found = np.isfinite(error).all(-1)
    e = error[found]
    length = np.linalg.norm(e, axis=-1)
    bias = float(np.linalg.norm(e.mean(0)))
    z = (e / sigma[found])[np.isfinite(sigma[found])]
    z2 = float((z**2).mean()) if z.size else float("nan")
    return Held(length.mean(), float(np.sqrt((length**2).mean())), length.max(), bias, z2, int(found.sum()))


def of_truth(table: pd.DataFrame, truth: pd.DataFrame) -> tuple[np.ndarray, pd.DataFrame]:
    """Where each row's target truly was; targets bear the name of the true one that they are nearest to."""
    table = table.copy()
    places = {
        name: resample(rows["time_s"].to_numpy(), rows[["x", "y", "z"]].to_numpy(), table["time_s"].to_numpy()).values
        for name, rows in truth.groupby("target")
    }
    p = table[["x", "y", "z"]].to_numpy()
    true = np.full(p.shape, np.nan)
    for rows in table.groupby("target").indices.values():
        name = min(places, key=lambda k: np.nanmedian(np.linalg.norm(p[rows] - places[k][rows], axis=-1)))
        true[rows] = places[name][rows]
        table.iloc[rows, table.columns.get_loc("target")] = name
    return true, table


def located(folder: Path, run: str, rig: Rig, true_cameras: bool = False) -> tuple[pd.DataFrame, np.ndarray]:
    """Trajectories of a run by stage locate, and where the targets truly were."""
    truth = pd.read_csv(folder / "runs" / run / "truth.csv")
    centroids = {name: read_parquet(folder / f"results/runs/{run}/centroids/{name}.parquet") for name in rig.found}
    cameras = {name: (camera, None) for name, camera in rig.true.items()} if true_cameras else rig.found
    points = None if true_cameras else rig.points
    table = locate(centroids, cameras, targets=truth["target"].nunique(), points=points).trajectories
    true, table = of_truth(table, truth)
    return table, true


def errors(table: pd.DataFrame, true: np.ndarray) -> Held:
    return held(table[["x", "y", "z"]].to_numpy() - true, table[["sigma_x", "sigma_y", "sigma_z"]].to_numpy())


def centroid_error(folder: Path, run: str, rig: Rig) -> dict[str, np.ndarray]:
    """Measured minus true position of a run's one target in each camera's pictures, px (n, 2)."""
    truth = pd.read_csv(folder / "runs" / run / "truth.csv")
    out = {}
    for name, camera in rig.true.items():
        table = read_parquet(folder / f"results/runs/{run}/centroids/{name}.parquet")
        at = truth["time_s"].to_numpy(), truth[["x", "y", "z"]].to_numpy(), table["time_s"].to_numpy()
        out[name] = table[["Xf", "Yf"]].to_numpy() - project(camera, resample(*at).values)
    return out


def apart(folder: Path, run: str, rig: Rig, rng: np.random.Generator) -> list[tuple[str, Held]]:
    """The error of a run of one target, and what it would be with only some of its causes."""
    table, true = located(folder, run, rig)
    whole = errors(table, true)
    with_true = errors(*located(folder, run, rig, true_cameras=True))
    cameras = list(rig.true.values())
    exact = np.stack([project(camera, true) for camera in cameras])
    found = [known.camera for known in rig.found.values()]
    answer = locate_points(found, exact, sd=1.0)
    own = centroid_error(folder, run, rig)
    scatter = np.array([np.nanstd(e[np.abs(e).max(-1) < 1], axis=0) for e in own.values()])
    # many times over: a floor is an expectation
    noisy = np.repeat(exact, 20, axis=1)
    noisy += rng.normal(0, 1, noisy.shape) * scatter[:, None]
    floor = locate_points(cameras, noisy, sd=np.broadcast_to(scatter[:, None], noisy.shape))
    for name, e in own.items():
        good = e[np.abs(e).max(-1) < 1]
        bias, sd = good.mean(0), good.std(0)
        print(f"    {name}: centroids off by {bias[0]:+.4f} {bias[1]:+.4f} px, scattered by {sd[0]:.4f} {sd[1]:.4f} px")
    return [
        ("the workflow", whole),
        ("the same centroids, true cameras", with_true),
        ("exact centroids, found cameras", held(answer.point - true, np.full(true.shape, np.nan))),
        ("floor: scatter alone", held(floor.point - np.repeat(true, 20, axis=0), floor.sigma)),
    ]


class Drawn(NamedTuple):
    """Four cameras as other draws of the survey give them: by stage calibrate, and by maximum likelihood."""

    found: list[dict[str, Calibrated]]
    best: list[dict[str, Calibrated]]
    points: list[dict[str, pd.DataFrame]]


def drawn(folder: Path, plan: dict[str, Any], draws: int) -> Drawn:
    """The calibration of the same sightings by further surveys."""
    scenario, rig = scenario_from(plan), rig_of(folder, CAMERAS)
    sd = scenario.calibration.survey.error
    tags, hung = scenario.points()
    rng = np.random.default_rng([scenario.seed, 6])
    out = Drawn([], [], [])
    for _ in range(draws):
        thought = hung + rng.normal(0, sd, hung.shape)
        tables = {name: _surveyed(rig.points[name], tags, thought, sd) for name in CAMERAS}
        own, best = {}, {}
        for name, table in tables.items():
            camera = rig.true[name]
            done = calibrate(table, image_size=camera.image_size, sensor=(8.8, 6.6), camera=name, search=False)
            own[name], tables[name] = Calibrated(done.camera, done.uncertainty, done.record), done.points
            p, b, noise = (table[list(names)].to_numpy() for names in ("xyz", ("Xf", "Yf"), ("sd_x", "sd_y")))
            fit = refine(camera, p, b, free=free_parameters("tsai"), sd=noise, survey=sd)
            best[name] = Calibrated(fit.camera, fit.uncertainty, done.record)
        out.found.append(own)
        out.best.append(best)
        out.points.append(tables)
    return out


def _surveyed(points: pd.DataFrame, tags: list[str], thought: np.ndarray, sd: float) -> pd.DataFrame:
    """Sightings with another survey of their points."""
    rows = [tags.index(str(tag)) for tag in points["tag"]]
    kept = points.drop(columns=["used", "reason", "residual_x", "residual_y"], errors="ignore")
    return kept.assign(**dict(zip("xyz", thought[rows].T, strict=True)), sigma=sd)


def of_draws(folder: Path, rig: Rig, others: Drawn) -> None:
    """The error of the run `pluck` with the cameras of each draw, its mean and one standard error."""
    for name, cameras in (("other surveys, calibrate", others.found), ("other surveys, best fit", others.best)):
        whole = []
        for own, points in zip(cameras, others.points, strict=True):
            of = Rig(rig.true, {n: own[n] for n in rig.true}, {n: points[n] for n in rig.true}, rig.field)
            whole.append(errors(*located(folder, "pluck", of)))
        mean = np.array([h.mean for h in whole])
        share, spread = rig.field / mean.mean(), mean.std(ddof=1) / np.sqrt(len(mean)) / mean.mean()
        square = np.mean([h.normalised for h in whole])
        print(f"  pluck: {name:29}  {mean.mean():>8.5f} {share:>9.0f} +- {share * spread:.0f} ({len(mean)} draws), z^2 "
              f"{square:.2f}")  # fmt: skip


def report(folder: Path, plan: dict[str, Any], draws: int) -> None:
    """Print everything."""
    others = drawn(folder, plan, draws) if draws else None
    rng = np.random.default_rng(0)
    for m in (2, 3, 4):
        rig = rig_of(folder, CAMERAS[:m])
        print(f"\n{m} cameras; diagonal field {rig.field:.1f} in")
        print(HEAD)
        for name, h in apart(folder, "pluck", rig, rng):
            print(f"  pluck: {name:29} {h.line(rig.field)}")
        if others is not None:
            of_draws(folder, rig, others)
        lost(folder, rig)
        crossing(folder, rig)


def lost(folder: Path, rig: Rig) -> None:
    table, true = located(folder, "lost", rig)
    t = table["time_s"].to_numpy()
    t = t - pd.read_csv(folder / "runs/lost/truth.csv")["time_s"].iloc[0]
    during = (t >= HIDDEN[0]) & (t <= HIDDEN[1])
    for name, part in (("cam1 sees it", ~during), ("cam1 does not", during)):
        rows, fixed = table[part], table.loc[part, "x"].notna()
        flagged = int((rows.loc[~fixed, "flag"] != "").sum())
        h = errors(rows, true[part]).line(rig.field) if fixed.any() else ""
        print(f"  lost: {name:30} {h}  of {len(rows)}; NaN {int((~fixed).sum())}, flagged {flagged}")


def crossing(folder: Path, rig: Rig) -> None:
    table, true = located(folder, "crossing", rig)
    merged = table["flag"].str.contains("cam1:").to_numpy()
    for name, part in (("apart in cam1", ~merged), ("merged or hidden in cam1", merged)):
        rows, fixed = table[part], table.loc[part, "x"].notna()
        h = errors(rows, true[part]).line(rig.field) if fixed.any() else ""
        print(f"  crossing: {name:26} {h}  of {len(rows)}; NaN {int((~fixed).sum())}")
    print(f"  crossing: tracks of {table.groupby('target').size().to_dict()}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1991)
    parser.add_argument("--cores", type=int, default=1)
    parser.add_argument("--survey", type=float, default=0.0, help="in, sd of each coordinate of the survey")
    parser.add_argument("--draws", type=int, default=0, help="of the survey, for the run `pluck`")
    args = parser.parse_args()
    asked = laboratory(args.seed, args.survey)
    make(args.folder, asked, args.cores)
    report(args.folder, asked, args.draws)

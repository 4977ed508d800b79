"""How well a waved wand calibrates, over the floor of perfectly known cameras.

    python benchmarks/wand.py [--seeds 5] [--first 0] [--moments 500] [--noise 0.1]

Random rigs of two and four cameras with different lenses, a wand waved at random, ends named at random in each camera.
For each: the time, the mean error of 500 held-out points after a rigid motion (the wand gives no axes) over that of the
true cameras with the same noise, and the mean square of the errors over sigma, each coordinate, in the first camera's
axes. `late`: the clocks of all cameras but the first are unknown; `blind`: one camera sees half of the time.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time

import numpy as np
import pandas as pd

from vidtrack.calibration.wand.measured import wand_of
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import Camera, contains, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import look_at, position_from_angles
from vidtrack.stages.wand import calibrate_by_wand

LIMIT = 1.5


def rig(rng: np.random.Generator, m: int) -> list[Camera]:
    """Cameras around the volume, each with its own lens, sensor of square pixels."""
    cameras = []
    start = rng.uniform(0, 360)
    for i in range(m):
        width, height = ((640, 480), (1280, 960), (1920, 1080))[int(rng.integers(3))]
        distance, pan = rng.uniform(110, 190), start + i * rng.uniform(50, 85)
        at = position_from_angles((0, 0, 0), pan_deg=pan, tilt_deg=rng.uniform(5, 45), distance=distance)
        R = look_at(at, rng.uniform(-6, 6, 3), roll_deg=rng.uniform(-10, 10), up=(0, 0, 1))
        f = width * distance / rng.uniform(70, 100)
        half = width / 2
        Cx, Cy = (width - 1) / 2 + rng.normal(0, 0.01 * width), (height - 1) / 2 + rng.normal(0, 0.01 * width)
        kappa1 = rng.uniform(-0.04, 0.08) / half**2
        cameras.append(Camera(Cx, Cy, 1.0, 1.0, 1.0, f, kappa1, R, -R @ at, (width, height), name=f"cam{i + 1}"))
    return cameras


def tracks(rng, cameras, n, noise, late, blind):
    """What the cameras followed of a wand of 20, as tables."""
    hz, phase = rng.uniform(0.1, 0.5, (2, 3, 3)), rng.uniform(0, 6.3, (2, 3, 3))
    t = np.arange(n) / 30
    out = {}
    for i, camera in enumerate(cameras):
        swings = np.sin(2 * np.pi * hz[..., None] * (t + late[i]) + phase[..., None])
        middle, along = 14 * swings[0].sum(0).T / 1.5, swings[1].sum(0).T + 0.1
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        ends = [middle - 10 * along, middle + 10 * along]
        rows = []
        for name, end in zip(rng.permutation(["t1", "t2"]), ends, strict=True):
            b = project(camera, end) + rng.normal(0, noise, (n, 2))
            seen = contains(camera, b) & ~((np.arange(n) // 60 % 2 == 1) & blind & (i == 1))
            rows.append(pd.DataFrame({"time_s": t[seen], "target": name, "Xf": b[seen, 0], "Yf": b[seen, 1]}))
        out[camera.name] = pd.concat(rows, ignore_index=True).assign(sd_x=noise, sd_y=noise, flag="")
    return out


def error_over_floor(rng, found, truth, noise) -> tuple[float, float]:
    """Held-out error over the floor, after a rigid motion, and its mean square over sigma."""
    q = rng.uniform(-18, 18, (500, 3))
    s = np.stack([project(c, q) for c in truth]) + rng.normal(0, noise, (len(truth), 500, 2))
    floor = np.linalg.norm(locate_points(truth, s, sd=noise).point - q, axis=-1).mean()
    joint = np.asarray(found.records[0]["joint"]["covariance"])
    known = locate_points(found.cameras, s, sd=noise, uncertainties=found.uncertainties, joint=joint)
    p = known.point
    U, _, Vt = np.linalg.svd((q - q.mean(0)).T @ (p - p.mean(0)))
    R = (U * [1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    off = (p - p.mean(0)) @ R.T + q.mean(0) - q
    own = p - (q @ truth[0].R.T + truth[0].T)
    square = np.einsum("na,nab,nb->n", own, np.linalg.inv(known.covariance), own) / 3
    return float(np.linalg.norm(off, axis=-1).mean() / floor), float(square.mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--moments", type=int, default=500)
    parser.add_argument("--noise", type=float, default=0.1)
    asked = parser.parse_args()
    wand = wand_of({"A-B": 20.0}, 0.002)
    ratios, squares = [], []
    for seed in range(asked.first, asked.first + asked.seeds):
        for m, kind in ((2, ""), (4, ""), (3, "late"), (3, "blind")):
            rng = np.random.default_rng([seed, m, len(kind)])
            truth = rig(rng, m)
            late = [0.0, *rng.uniform(-0.8, 0.8, m - 1)] if kind == "late" else [0.0] * m
            seen = tracks(rng, truth, asked.moments, asked.noise, late, kind == "blind")
            nominal = {
                c.name: c.with_(
                    Cx=(c.image_size[0] - 1) / 2, Cy=(c.image_size[1] - 1) / 2, R=np.eye(3), T=np.zeros(3), f=1.0
                ).without_lens()
                for c in truth
            }
            began = time.process_time()
            unknown = [c.name for c in truth[1:]] if kind == "late" else []
            try:
                found = calibrate_by_wand(seen, nominal, wand, units="in", axes="camera", late=unknown)
            except VidtrackError as error:
                print(f"seed {seed}: {m} cameras {kind:6} refused: {error}")
                ratios.append(np.inf)
                continue
            took = time.process_time() - began
            ratio, square = error_over_floor(rng, found, truth, asked.noise)
            ratios.append(ratio)
            squares.append(square)
            codes = {f.code for f in found.findings} | {f["code"] for r in found.records for f in r["findings"]}
            listed = ", ".join(sorted(codes - {"wand-axes-of-camera"}))
            word = "ok" if ratio <= LIMIT else "SHORT"
            print(
                f"seed {seed}: {m} cameras {kind:6} {took:5.1f} s, error {ratio:.3f} of the floor {word}, "
                f"square {square:.2f} {listed}"
            )
    print(f"worst {max(ratios):.3f} of the floor, median {np.median(ratios):.3f}; mean square {np.mean(squares):.2f}")


if __name__ == "__main__":
    main()

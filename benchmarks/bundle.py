"""What the bundle gains, and how long it takes.

    python benchmarks/bundle.py accuracy [--trials 25]     simulated thesis rig, against the issue's limits
    python benchmarks/bundle.py real [--rounds 3]          4 cameras, 1805 real points (../shared/real/points)
    python benchmarks/bundle.py held-out                   leave-one-out of 64 points and 2 cameras

`real` takes turns with scipy.optimize.least_squares on the same problem (sparse Jacobian, trust region), which is
how a bundle is written by hand in Python. Times are processor seconds of one thread; compare the ratios.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import statistics
import time
from pathlib import Path

import numpy as np

from vidtrack.calibration.assessment.heldout import held_out, refit_alone, refit_closed_form, refit_together
from vidtrack.calibration.bundle import bundle
from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.calibration.camera.tsai import camera_from_closed_form, closed_form
from vidtrack.geometry.camera import project
from vidtrack.geometry.jacobian import PARAMETERS, derivatives, stepped
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_points, thesis_rig

FREE = free_parameters("tsai")
REAL = Path(__file__).parents[1] / "../shared/real/points/proptv_rbc4cam"

# centroid noise px, tolerance in (an error within +- it, any as likely), cameras, least diagonal / mean error
CASES = [
    (0.5, 1 / 16, 2, None),
    (0.25, 1 / 16, 2, 1600),
    (0.1, 1 / 32, 2, 4000),
    (0.05, 1 / 32, 2, 7500),
    (0.1, 1 / 32, 3, None),
    (0.1, 1 / 32, 4, 6500),
]


def accuracy(trials: int) -> None:
    p = thesis_points()[1]
    print(f"{'noise px':>8} {'survey in':>9} cameras  {'linear':>7} {'full':>7} {'bundle':>7} {'floor':>7}  full/floor")
    for noise, tolerance, m, least in CASES:
        rng = np.random.default_rng(0)
        cameras = thesis_rig(m)
        errors: dict[str, list[float]] = {"linear": [], "full": [], "bundle": [], "floor": []}
        for _ in range(trials):
            true = p + rng.uniform(-tolerance, tolerance, p.shape)
            b = np.array([project(camera, true) for camera in cameras]) + rng.normal(0, noise, (m, len(p), 2))
            found = {"floor": cameras}
            found["linear"] = [
                camera_from_closed_form(closed_form(p, s, Cx=c.Cx, Cy=c.Cy, dx=c.dx, dy=c.dy), c.image_size)
                for c, s in zip(cameras, b, strict=True)
            ]
            survey = tolerance / np.sqrt(3)
            found["full"] = [
                refine(c, p, s, free=FREE, sd=noise, survey=survey).camera
                for c, s in zip(found["linear"], b, strict=True)
            ]
            found["bundle"] = list(bundle(found["full"], p, b, sigma=survey, free=[FREE] * m).cameras)
            q = rng.uniform(p.min(0), p.max(0), (500, 3))
            sights = np.array([project(camera, q) for camera in cameras]) + rng.normal(0, noise, (m, 500, 2))
            for name, each in found.items():
                errors[name].append(
                    float(np.linalg.norm(locate_points(each, sights, sd=noise).point - q, axis=-1).mean())
                )
        share = {name: 160 / np.mean(each) for name, each in errors.items()}
        verdict = "" if least is None else f"  {'ok' if share['full'] >= least else 'SHORT'} (>= {least})"
        row = " ".join(f"{share[name]:7.0f}" for name in ("linear", "full", "bundle", "floor"))
        print(f"{noise:8} {tolerance:9.5f} {m:7}  {row}  {share['floor'] / share['full']:.3f}{verdict}")


def real(rounds: int) -> None:
    tables = [np.genfromtxt(REAL / f"cam{i}.csv", delimiter=",", skip_header=1) for i in range(4)]
    p, b = tables[0][:, 1:4], np.array([table[:, 4:6] for table in tables])
    start = [camera_from_closed_form(closed_form(p, s, Cx=1279.5, Cy=1079.5, dx=1, dy=1), (2560, 2160)) for s in b]
    for model in ("tsai", "affine"):
        free = free_parameters(model)
        times: dict[str, list[float]] = {"full": [], "bundle": [], "least_squares": []}
        for round_ in range(rounds):
            began = time.process_time()
            alone = [refine(camera, p, s, free=free).camera for camera, s in zip(start, b, strict=True)]
            times["full"].append(time.process_time() - began)
            began = time.process_time()
            found = bundle(alone, p, b, sigma=0.1, free=[free] * 4)
            times["bundle"].append(time.process_time() - began)
            if round_ == 0:
                began = time.process_time()
                cost = _by_hand(alone, p, b, found, free)
                times["least_squares"].append(time.process_time() - began)
                ours = _cost(found.residuals, found, p)
                print(f"{model}: cost {ours:.1f} against {cost:.1f} by least_squares")
        each = {name: statistics.median(t) for name, t in times.items()}
        rms = [np.sqrt(((locate_points(c, b).point - p) ** 2).sum(-1).mean()) for c in (alone, found.cameras)]
        print(f"{model}: full {each['full']:.2f} s, bundle {each['bundle']:.2f} s in {found.steps} steps,", end=" ")
        print(f"least_squares {each['least_squares'] / each['bundle']:.1f} times as long;", end=" ")
        print(f"3-D rms {rms[0]:.3f} mm alone, {rms[1]:.3f} together; noise {found.sigma_px:.2f} px")


def _cost(residuals, found, p) -> float:
    return float(((residuals / found.sd) ** 2).sum() + (((found.points - p) / 0.1) ** 2).sum())


def _by_hand(start, p, b, found, free) -> float:
    """The same problem by scipy: analytic sparse Jacobian, the bundle's own noise."""
    from scipy.optimize import least_squares
    from scipy.sparse import block_diag, csr_matrix, diags, hstack, vstack

    k, n, sd = len(free), len(p), float(found.sigma_px)
    columns = [PARAMETERS.index(name) for name in free]
    scale = np.concatenate([found.uncertainty(i).standard_errors for i in range(4)])

    def at(v):
        steps = (v[: 4 * k] * scale).reshape(4, k)
        cameras = [stepped(c, found.pivot, dict(zip(free, s, strict=True))) for c, s in zip(start, steps, strict=True)]
        return cameras, p + v[4 * k :].reshape(n, 3) * 0.1

    def residuals(v):
        cameras, x = at(v)
        left = [((s - project(c, x)) / sd).ravel() for c, s in zip(cameras, b, strict=True)]
        return np.concatenate([*left, v[4 * k :]])

    def jacobian(v):
        cameras, x = at(v)
        rows = []
        for i, camera in enumerate(cameras):
            derived = derivatives(camera, x, found.pivot)
            own = np.zeros((2 * n, 4 * k))
            own[:, i * k : (i + 1) * k] = -derived.by_parameter[..., columns].reshape(2 * n, k) / sd
            rows.append(hstack([csr_matrix(own * scale), block_diag(list(-derived.by_point / sd * 0.1), format="csr")]))
        return vstack([*rows, hstack([csr_matrix((3 * n, 4 * k)), diags(np.ones(3 * n))])], format="csr")

    found_ = least_squares(residuals, np.zeros(4 * k + 3 * n), jac=jacobian, method="trf", max_nfev=30)
    return float(2 * found_.cost)


def held_out_errors() -> None:
    rng = np.random.default_rng(0)
    p, cameras = thesis_points()[1], thesis_rig()
    b = np.array([project(c, p + rng.uniform(-1, 1, p.shape) / 32) for c in cameras]) + rng.normal(0, 0.1, (2, 64, 2))
    fits = [refine(camera, p, s, free=FREE).camera for camera, s in zip(cameras, b, strict=True)]
    sigma = 1 / 32 / np.sqrt(3)
    for name, refit in (
        ("linear", refit_closed_form(fits, p, b)),
        ("full", refit_alone(fits, p, b, free=[FREE] * 2)),
        ("bundle", refit_together(fits, p, b, free=[FREE] * 2, sigma=sigma, sd=0.1)),
    ):
        began = time.process_time()
        out = held_out(p, b, refit)
        took = time.process_time() - began
        print(
            f"{name}: {out.method} in {took:.2f} s, mean 3-D error {np.linalg.norm(out.error, axis=-1).mean():.4f} in"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["accuracy", "real", "held-out"])
    parser.add_argument("--trials", type=int, default=25)
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    if asked.what == "accuracy":
        accuracy(asked.trials)
    elif asked.what == "real":
        real(asked.rounds)
    else:
        held_out_errors()


if __name__ == "__main__":
    main()

"""How well and how fast one camera is calibrated, beside OpenCV's calibrateCamera.

    python benchmarks/calibration.py accuracy [--trials 25]    simulated thesis rig, held-out points, by method
    python benchmarks/calibration.py bad [--trials 25]         a swapped pair of tags; 6 of 64 points off by 10 px
    python benchmarks/calibration.py time [--rounds 5]         the project's limits, in seconds, and the ratio to OpenCV
    python benchmarks/calibration.py real                      ../shared/real/points: what is left, and what is refused

Accuracy is one over the mean error's share of the diagonal field (160 in): higher is better. The survey errs by
anything within its tolerance, each as likely. OpenCV fits its own model: kappa1 alone as here ("k1"), or all it has.
Times are processor seconds of one thread, medians, taking turns.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pandas as pd

from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.calibrate import calibrate

REAL = Path(__file__).parents[1] / "../shared/real/points"
RIG = {"image_size": (512, 480), "sensor": (8.8, 6.6)}
DIAGONAL = 160.0

# centroid noise px, survey tolerance in, cameras, least diagonal / mean error that full must reach
CASES = [
    (0.5, 1 / 16, 2, 0),
    (0.25, 1 / 16, 2, 1600),
    (0.1, 1 / 32, 2, 4000),
    (0.05, 1 / 32, 2, 7500),
    (0.1, 1 / 32, 4, 6500),
]

PLAIN = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
RICH = cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL | cv2.CALIB_TILTED_MODEL


def sightings(camera: Camera, noise: float, survey: np.ndarray, rng: np.random.Generator) -> pd.DataFrame:
    tags, p = thesis_points()
    b = project(camera, p) + rng.normal(0, noise, (len(p), 2))
    return table(tags, survey, b)


def table(tags: list[str], p: np.ndarray, b: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame({"tag": tags, **dict(zip("xyz", p.T, strict=True)), "Xf": b[:, 0], "Yf": b[:, 1]})


def columns(t: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    return t[["x", "y", "z"]].to_numpy(float), t[["Xf", "Yf"]].to_numpy(float)


def by_opencv(t: pd.DataFrame, size: tuple[int, int], f: float, flags: int) -> tuple[float, tuple]:
    """The rms distance left, px, and (K, distortion, rvec, tvec)."""
    p, b = columns(t)
    K = np.array([[f, 0, (size[0] - 1) / 2], [0, f, (size[1] - 1) / 2], [0, 0, 1]])
    rms, K, k, r, s = cv2.calibrateCamera(
        [p.astype(np.float32)],
        [b.astype(np.float32)],
        size,
        K,
        np.zeros(14),
        flags=cv2.CALIB_USE_INTRINSIC_GUESS | flags,
    )
    return rms, (K, k, r[0], s[0])


def located_by_opencv(found: list[tuple], b: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Least squares of OpenCV's reprojection errors: Gauss-Newton from a start, derivatives by differences."""
    x, h = start.copy(), 1e-3
    for _ in range(4):
        N, g = np.zeros((len(x), 3, 3)), np.zeros((len(x), 3))
        for (K, k, r, t), seen in zip(found, b, strict=True):

            def at(q: np.ndarray, K=K, k=k, r=r, t=t) -> np.ndarray:
                return cv2.projectPoints(q[:, None], r, t, K, k)[0][:, 0]

            J = np.stack([(at(x + h * e) - at(x - h * e)) / (2 * h) for e in np.eye(3)], -1)
            N += np.swapaxes(J, 1, 2) @ J
            g += np.einsum("nij,ni->nj", J, seen - at(x))
        x += np.linalg.solve(N, g[..., None])[..., 0]
    return x


def held_out(n_cameras: int, noise: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    p = thesis_points()[1]
    truth = rng.uniform(p.min(0), p.max(0), (500, 3))
    return truth, np.stack([project(c, truth) + rng.normal(0, noise, (500, 2)) for c in thesis_rig(n_cameras)])


def trial(seed: int, noise: float, tolerance: float, m: int) -> tuple[list[pd.DataFrame], np.ndarray, np.ndarray]:
    """Of each camera a table of what it saw of points surveyed so well; 500 other points, and how they are seen."""
    rng = np.random.default_rng(seed)
    p = thesis_points()[1]
    survey = p + rng.uniform(-tolerance, tolerance, p.shape)
    tables = [sightings(c, noise, survey, rng) for c in thesis_rig(m)]
    return tables, *held_out(m, noise, rng)


def error(cameras: list[Camera], truth: np.ndarray, b: np.ndarray, noise: float) -> float:
    return float(np.linalg.norm(locate_points(cameras, b, sd=noise).point - truth, axis=1).mean())


def accuracy(trials: int) -> None:
    methods: dict[str, dict] = {
        "linear": {"refine": "linear"},
        "centre": {"refine": "centre"},
        "full": {},
        "weighed": {},
        "auto": {"model": "auto"},
    }
    heads = [*methods, "OpenCV k1", "floor"]
    print(
        f"{'noise px':>8} {'survey in':>9} cameras" + "".join(f"{head:>10}" for head in heads) + "  floor/full  limit"
    )
    for noise, tolerance, m, least in CASES:
        total = dict.fromkeys(heads, 0.0)
        for seed in range(trials):
            tables, truth, b = trial(seed, noise, tolerance, m)
            for name, settings in methods.items():
                sigma = tolerance / np.sqrt(3) if name == "weighed" else 0.0
                found = [calibrate(t, sigma=sigma, search=False, **RIG, **settings).camera for t in tables]
                total[name] += error(found, truth, b, noise)
            theirs = [by_opencv(t, (512, 480), 800.0, PLAIN)[1] for t in tables]
            total["OpenCV k1"] += float(np.linalg.norm(located_by_opencv(theirs, b, truth) - truth, axis=1).mean())
            total["floor"] += error(thesis_rig(m), truth, b, noise)
        share = {name: DIAGONAL * trials / value for name, value in total.items()}
        good = "" if not least else f"{least} {'reached' if share['full'] >= least else 'MISSED'}"
        row = "".join(f"{'1/' + format(share[head], '.0f'):>10}" for head in heads)
        print(f"{noise:8.2f} {tolerance:9.4f} {m:7d}{row}  {share['floor'] / share['full']:10.3f}  {good}")


def bad(trials: int) -> None:
    print(f"{'noise px':>8}  spoilt by     error over clean   all named   named wrongly")
    for noise, tolerance, m, _ in CASES[1:4]:
        clean = 0.0
        for kind in ("nothing", "a swap", "6 off by 10"):
            total, named, wrongly = 0.0, 0, 0
            for seed in range(trials):
                tables, truth, b = trial(seed, noise, tolerance, m)
                found = []
                for i, t in enumerate(tables):
                    rows = spoil(t, kind, np.random.default_rng([seed, i]))
                    found.append(calibrate(t, search=False, **RIG))
                    out = set(np.flatnonzero(~found[-1].points["used"]).tolist())
                    said = all("swapped" in r for r in found[-1].points["reason"][rows]) or kind != "a swap"
                    named += out >= set(rows) and said
                    wrongly += len(out - set(rows))
                total += error([c.camera for c in found], truth, b, noise)
            clean = clean or total
            print(f"{noise:8.2f}  {kind:12} {total / clean:17.3f} {named:6d} of {m * trials} {wrongly:15d}")


def spoil(t: pd.DataFrame, kind: str, rng: np.random.Generator) -> list[int]:
    """Spoil some rows in place; the rows."""
    if kind == "a swap":
        rows = rng.choice(64, 2, replace=False)
        t.loc[rows, ["Xf", "Yf"]] = t.loc[rows[::-1], ["Xf", "Yf"]].to_numpy()
    elif kind == "6 off by 10":
        rows = rng.choice(64, 6, replace=False)
        angle = rng.uniform(0, 2 * np.pi, 6)
        t.loc[rows, ["Xf", "Yf"]] += 10 * np.stack([np.cos(angle), np.sin(angle)], -1)
    else:
        return []
    return rows.tolist()


def timed(entries: list[tuple[str, Callable[[], object]]], rounds: int) -> list[float]:
    taken: list[list[float]] = [[] for _ in entries]
    for _ in range(rounds + 1):
        for out, (_, run) in zip(taken, entries, strict=True):
            start = time.process_time()
            run()
            out.append(time.process_time() - start)
    return [statistics.median(out[1:]) for out in taken]


def times(rounds: int) -> None:
    cv2.setNumThreads(1)
    rng = np.random.default_rng(0)
    p = thesis_points()[1]
    two = [sightings(c, 0.1, p + rng.uniform(-1, 1, p.shape) / 32, rng) for c in thesis_rig(2)]
    sets: list[tuple[str, list[pd.DataFrame], dict, float, float]] = [("2 cameras, 64 points", two, RIG, 800.0, 1.0)]
    if REAL.exists():
        glass = [real(f"proptv_rbc4cam/cam{i}.csv") for i in range(4)]
        sets.append(("4 cameras, 1805 points", glass, {"image_size": (2560, 2160)}, 7000.0, 3.0))
    print(f"{'':24} {'full, map':>10} {'auto, map':>10} {'full only':>10} {'OpenCV k1':>10} {'OpenCV all':>10}  limit")
    for name, tables, how, f, limit in sets:
        size = how["image_size"]

        def ours(tables=tables, how=how, **settings) -> None:
            for t in tables:
                calibrate(t, **how, **settings)

        def theirs(flags: int, tables=tables, size=size, f=f) -> None:
            for t in tables:
                by_opencv(t, size, f, flags)

        entries = [
            ("full", ours),
            ("auto", lambda ours=ours: ours(model="auto")),
            ("alone", lambda ours=ours: ours(search=False)),
            ("k1", lambda theirs=theirs: theirs(PLAIN)),
            ("all", lambda theirs=theirs: theirs(RICH)),
        ]
        print(f"{name:24} " + " ".join(f"{t:10.3f}" for t in timed(entries, rounds)) + f"  {limit:7.0f}")
    print("full and auto find bad points, choose among starts, map the centre and give covariances; OpenCV fits once.")


def real(name: str) -> pd.DataFrame:
    return pd.read_csv(REAL / name, dtype={"tag": str}).rename(columns={"X": "Xf", "Y": "Yf"})


def real_sets() -> None:
    size = {"willson": (576, 384), "myptv_e": (1280, 1024), "proptv_": (2560, 2160), "bailus_": (1280, 1024)}
    for path in sorted(REAL.glob("*/*.csv")):
        name = f"{path.parent.name}/{path.name}"
        for model in ("tsai", "auto"):
            try:
                found = calibrate(real(name), image_size=size.get(name[:7], (768, 576)), model=model, search=False)
            except VidtrackError as refused:
                print(f"{name:24} refused{str(refused)[9:110]}...")
                break
            used = f"{found.record['n_points']} of {len(found.points)}"
            print(
                f"{name:24} {model:5} -> {found.record['model']:7} {found.record['rms_px']:7.4f} px rms, {used} points"
            )
    glass = [real(f"proptv_rbc4cam/cam{i}.csv") for i in range(4)]
    p, _ = columns(glass[0])
    b = np.stack([columns(t)[1] for t in glass])
    for model in ("tsai", "auto"):
        found = [calibrate(t, image_size=(2560, 2160), model=model, search=False).camera for t in glass]
        off = locate_points(found, b).point - p
        print(f"proptv_rbc4cam, 4 cameras, {model}: {np.sqrt((off**2).sum(1).mean()):.3f} mm rms over {len(p)} points")
    for head, flags in (("OpenCV k1", PLAIN), ("OpenCV all", RICH)):
        theirs = [by_opencv(t, (2560, 2160), 7000.0, flags)[1] for t in glass]
        off = located_by_opencv(theirs, b, p) - p
        print(f"proptv_rbc4cam, 4 cameras, {head}: {np.sqrt((off**2).sum(1).mean()):.3f} mm rms")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("accuracy", "bad", "time", "real"))
    parser.add_argument("--trials", type=int, default=25)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    if given.what == "accuracy":
        accuracy(given.trials)
    elif given.what == "bad":
        bad(given.trials)
    elif given.what == "time":
        times(given.rounds)
    else:
        real_sets()


if __name__ == "__main__":
    main()

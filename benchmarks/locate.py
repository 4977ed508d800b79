"""How fast points are located, and how well, beside aniposelib, optv and OpenCV.

    python -m venv /tmp/peers && /tmp/peers/bin/pip install numpy scipy opencv-python-headless aniposelib optv
    PYTHONPATH=. /tmp/peers/bin/python benchmarks/locate.py peers [--points 100000] [--rounds 5]
    python benchmarks/locate.py limits [--points 1000000]     the project's own limits

Every package gets what its own camera model sees of the same points from the same places, with the same noise, and
answers with world positions; undistortion is counted. They take turns; medians of processor seconds of one thread.
Only vidtrack answers with a covariance too. A package that is not installed is left out.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

from vidtrack.calibration.camera.refine import Uncertainty, free_parameters, refine
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.shared_survey import Survey, joint_covariance
from vidtrack.simulate.rig import thesis_points, thesis_rig

NOISE = 0.1
SURVEY = 1 / 32
Entry = tuple[str, Callable[[], np.ndarray]]


def places(n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-1, 1, (n, 3)) * (27, 6, 9)


def ours(p: np.ndarray, m: int, noise: np.ndarray) -> list[Entry]:
    cameras = thesis_rig(m)
    b = np.stack([project(c, p) for c in cameras]) + noise[:m]
    return [
        ("vidtrack, covariance", lambda: locate_points(cameras, b, sd=NOISE).point),
        ("vidtrack, linear", lambda: locate_points(cameras, b, sd=NOISE, refine=False).point),
    ]


def opencv(p: np.ndarray, m: int, noise: np.ndarray) -> list[Entry]:
    try:
        import cv2
    except ImportError:
        return []
    cv2.setNumThreads(1)
    rig = [as_opencv(c) for c in thesis_rig(m)]
    b = [cv2.projectPoints(p, *pose, K, k)[0][:, 0] + e for (K, k, pose), e in zip(rig, noise, strict=False)]
    if m != 2:
        return []
    matrices = [np.column_stack([cv2.Rodrigues(r)[0], t]) for _, _, (r, t) in rig]

    def locate() -> np.ndarray:
        flat = [cv2.undistortPoints(x[:, None], K, k)[:, 0].T for x, (K, k, _) in zip(b, rig, strict=True)]
        h = cv2.triangulatePoints(*matrices, *flat)
        return (h[:3] / h[3]).T

    return [("cv2.triangulatePoints", locate)]


def as_opencv(c) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Matrix, distortion and pose of OpenCV's camera nearest to Tsai's (its lens acts the other way)."""
    import cv2

    K = np.array([[c.Sx * c.f / c.dx, 0, c.Cx], [0, c.f / c.dy, c.Cy], [0, 0, 1]])
    k = c.kappa1 * c.f**2
    return K, np.array([-k, 3 * k * k, 0, 0, 0]), (cv2.Rodrigues(c.R)[0].ravel(), np.array(c.T))


def anipose(p: np.ndarray, m: int, noise: np.ndarray, slow: int) -> list[Entry]:
    try:
        from aniposelib.cameras import Camera, CameraGroup
    except ImportError:
        return []
    cameras = []
    for c in thesis_rig(m):
        K, k, (r, t) = as_opencv(c)
        cameras.append(Camera(matrix=K, dist=k, rvec=r, tvec=t, size=c.image_size, name=c.name))
    group = CameraGroup(cameras)
    b = np.stack([camera.project(p).reshape(-1, 2) for camera in cameras]) + noise[:m]
    entries: list[Entry] = [
        ("aniposelib", lambda: group.triangulate(b)),
        ("aniposelib, fast", lambda: group.triangulate(b, fast=True)),
    ]
    if m > 2:
        entries.append(("aniposelib, RANSAC", lambda: group.triangulate_ransac(b[:, :slow], min_cams=3)[0]))
    return entries


def openptv(p: np.ndarray, m: int, noise: np.ndarray) -> list[Entry]:
    try:
        from optv.calibration import Calibration
        from optv.imgcoord import image_coordinates
        from optv.orientation import point_positions
        from optv.parameters import ControlParams, VolumeParams
        from optv.transforms import convert_arr_metric_to_pixel, convert_arr_pixel_to_metric, distorted_to_flat
    except ImportError:
        return []
    control = ControlParams(m)
    rig = thesis_rig(m)
    control.set_image_size(rig[0].image_size)
    control.set_pixel_size((rig[0].dx / 1.016, rig[0].dy))  # one pixel size for all cameras
    media = control.get_multimedia_params()
    media.set_n1(1.0)
    media.set_layers([1.0], [1.0])
    media.set_n3(1.0)
    calibrations, b = [], []
    for c, e in zip(rig, noise, strict=False):
        own = Calibration()
        R = np.stack([c.R[0], -c.R[1], -c.R[2]], -1)  # x right, y up, z backwards
        own.set_pos(np.ascontiguousarray(c.position))
        own.set_angles(np.array([np.arctan2(-R[1, 2], R[2, 2]), np.arcsin(R[0, 2]), np.arctan2(-R[0, 1], R[0, 0])]))
        own.set_primary_point(np.array([0.1, -0.1, c.f]))
        own.set_radial_distortion(np.array([-c.kappa1, 0.0, 0.0]))
        own.set_decentering(np.zeros(2))
        own.set_affine_trans(np.array([1.0, 0.0]))
        # air on both sides; the pane has only to lie before the cameras
        own.set_glass_vec(np.array([0.0, 0.0, 40.0]))
        calibrations.append(own)
        b.append(convert_arr_metric_to_pixel(image_coordinates(p, own, media), control) + e)

    def locate() -> np.ndarray:
        flat = [
            distorted_to_flat(convert_arr_pixel_to_metric(x, control), c) for x, c in zip(b, calibrations, strict=True)
        ]
        return point_positions(np.stack(flat, 1), control, calibrations, VolumeParams())[0]

    return [("optv", locate)]


def peers(n: int, rounds: int) -> None:
    rng = np.random.default_rng(0)
    p = places(n, rng)
    noise = rng.normal(0, NOISE, (4, n, 2))
    slow = min(n, 500)
    print(f"{n} points, {NOISE} px of noise; medians of {rounds} rounds")
    print(f"{'cameras':>7}  {'':24} {'thousand/s':>10} {'of vidtrack':>11} {'mean error in':>13}")
    for m in (2, 3, 4):
        entries = [
            *ours(p, m, noise),
            with_calibration(p, m, noise, rng),
            *opencv(p, m, noise),
            *anipose(p, m, noise, slow),
            *openptv(p, m, noise),
        ]
        if m > 2:
            entries += [rejection(p, m, noise, rng)]
        seconds: dict[str, list[float]] = {name: [] for name, _ in entries}
        error = {}
        for _ in range(rounds + 1):  # the first one warms up
            for name, run in entries:
                start = time.process_time()
                found = np.asarray(run())
                seconds[name].append((time.process_time() - start) / len(found))
                error[name] = float(np.nanmean(np.linalg.norm(found - p[: len(found)], axis=-1)))
        first = statistics.median(seconds[entries[0][0]][1:])
        for name, _ in entries:
            each = statistics.median(seconds[name][1:])
            print(f"{m:>7}  {name:24} {1e-3 / each:>10.2f} {first / each:>11.3g} {error[name]:>13.4f}")


def rejection(p: np.ndarray, m: int, noise: np.ndarray, rng: np.random.Generator) -> Entry:
    """One camera of every point is off by 20 px."""
    cameras = thesis_rig(m)
    b = np.stack([project(c, p) for c in cameras]) + noise[:m]
    angle = rng.uniform(0, 2 * np.pi, len(p))
    b[rng.integers(0, m, len(p)), np.arange(len(p))] += 20 * np.stack([np.cos(angle), np.sin(angle)], -1)
    return "vidtrack, one bad camera", lambda: locate_points(cameras, b, sd=NOISE, reject=2.0).point


def calibrated(m: int, rng: np.random.Generator) -> tuple[list[Camera], list[Uncertainty], np.ndarray]:
    """The rig as a calibration finds it, and the covariance of all its parameters, the survey's share included."""
    tags, p = thesis_points()
    free = free_parameters("tsai")
    fits = [
        refine(c, p, project(c, p) + rng.normal(0, NOISE, (len(p), 2)), free=free, sd=NOISE, survey=SURVEY)
        for c in thesis_rig(m)
    ]
    cameras, known = [fit.camera for fit in fits], [fit.uncertainty for fit in fits]
    return (
        cameras,
        known,
        joint_covariance(cameras, known, [Survey(tuple(tags), p, np.full(len(p), SURVEY), NOISE)] * m),
    )


def with_calibration(p: np.ndarray, m: int, noise: np.ndarray, rng: np.random.Generator) -> Entry:
    """The covariance carries what the calibrations left open."""
    b = np.stack([project(c, p) for c in thesis_rig(m)]) + noise[:m]
    cameras, known, joint = calibrated(m, rng)

    def locate() -> np.ndarray:
        return locate_points(cameras, b, sd=NOISE, uncertainties=known, joint=joint).point

    return "vidtrack, all covariance", locate


def limits(n: int, rounds: int) -> None:
    rng = np.random.default_rng(0)
    p = places(n, rng)
    noise = rng.normal(0, NOISE, (4, n, 2))
    few = n // 10
    methods = [
        ("2 cameras, with undistortion and covariance", n, ours(p, 2, noise)[0]),
        ("  with the calibration's covariance too", n, with_calibration(p, 2, noise, rng)),
        ("4 cameras", few, ours(p[:few], 4, noise[:, :few])[0]),
        ("  with the calibration's covariance too", few, with_calibration(p[:few], 4, noise[:, :few], rng)),
        ("4 cameras, every point with a bad one", few, rejection(p[:few], 4, noise[:, :few], rng)),
    ]
    seconds = np.min([[timed(run) for _, _, (_, run) in methods] for _ in range(rounds)], 0)
    print(f"shortest of {rounds} rounds; limits: 1.5 s a million from 2 cameras, 50,000 points/s with a bad camera")
    for (name, size, _), s in zip(methods, seconds, strict=True):
        print(f"{name:46} {size:>8} points {1e6 * s / size:>6.2f} s a million {size / s:>10.0f} points/s")


def timed(run: Callable[[], np.ndarray]) -> float:
    start = time.process_time()
    run()
    return time.process_time() - start


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["peers", "limits"])
    parser.add_argument("--points", type=int)
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    if args.what == "peers":
        peers(args.points or 100_000, args.rounds)
    else:
        limits(args.points or 1_000_000, args.rounds)

"""OpenPTV's test cavity: four cameras look through glass into water with hundreds of particles a frame, five frames.

    git clone https://github.com/OpenPTV/test_cavity
    python benchmarks/cavity.py test_cavity [--follow]

OpenPTV's own detections and results are in commit ec0043c: the detections that it joins to one particle are located
by vidtrack with the calibration of that commit, and the place compared with OpenPTV's own. Then what OpenPTV linked
over the frames is given to `associate` camera by camera, its correspondences forgotten: how many are joined again.
The misfit that is left in the pictures is that of the set's own calibration: the mean of the points nearest to each
pair of its lines of sight is OpenPTV's place to the last digit that is written. So the cameras are turned and shifted
until the lines of sight of what OpenPTV matched in the first two frames meet, and what is left in the other two frames
is printed, and how many particles are joined then (these have samples in all four frames).
With --follow the first camera's pictures go through the track stage, which is made for tens of targets: it follows few
of the thousand.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from fractions import Fraction
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from vidtrack.association.associate import associate
from vidtrack.association.tracklets import tracklets_of
from vidtrack.exchange.cameras.given import Said
from vidtrack.exchange.cameras.openptv import read
from vidtrack.geometry.camera import Camera, directions
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.refraction import paths
from vidtrack.geometry.triangulate import locate_points
from vidtrack.timing.frame import Frame, VideoInfo

SIZE, PIXEL = (1280, 1024), 0.012
FRAMES = range(10001, 10005)
RESULTS = "ec0043c"


def camera_of(folder: Path, i: int) -> Camera:
    """A camera with the glass that its file names: 6 mm, n 1.33, and 1.46 behind it, as parameters/ptv.par has it."""
    path = folder / f"cal/cam{i}.tif.ori"
    sensor = (SIZE[0] * PIXEL, SIZE[1] * PIXEL)
    given = read(path, Said(f"cam{i}", "mm", size=SIZE, sensor=sensor))
    glass = np.array(path.read_text().split()[-3:], float)
    way = -glass / np.linalg.norm(glass)  # from the camera into the water
    outer = glass - 6.0 * way
    name = "glass" + ("left" if glass[2] < 0 else "right")
    return given.camera.with_(through=(Interface(name, outer, way, (1.0, 1.33, 1.46), (6.0,)),))


def of_commit(folder: Path, name: str) -> list[list[float]]:
    """Rows of numbers of a file of OpenPTV's results."""
    text = subprocess.run(
        ["git", "-C", folder, "show", f"{RESULTS}:{name}"], capture_output=True, text=True, check=True
    ).stdout
    return [[float(x) for x in line.split()] for line in text.splitlines()[1:]]


def theirs(folder: Path, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) mm and detections (4, n, 2) px of the particles that OpenPTV found in a frame; NaN where unseen."""
    rows = np.array(of_commit(folder, f"res/rt_is.{frame}"))
    b = np.full((4, len(rows), 2), np.nan)
    for i in range(4):
        targets = np.array(of_commit(folder, f"img/cam{i + 1}.{frame}_targets"))
        number = rows[:, 4 + i].astype(int)
        b[i, number >= 0] = targets[number[number >= 0], 1:3] - 0.5  # the middle of the first pixel is 0.5 there
    return rows[:, 1:4], b


def calibration(folder: Path, to: str) -> Path:
    """A folder with the calibration that OpenPTV's results rest on; that of the last commit is another one."""
    packed = subprocess.run(["git", "-C", folder, "archive", RESULTS, "cal"], capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x", "-C", to], input=packed, check=True)
    return Path(to)


def chains(folder: Path) -> list[list[int]]:
    """Of particles that OpenPTV linked over all frames: the row in each frame."""
    following = [np.array(of_commit(folder, f"res/ptv_is.{frame}"))[:, 1].astype(int) for frame in FRAMES]
    out = []
    for row in range(len(following[0])):
        chain = [row]
        for after in following[:-1]:
            if after[chain[-1]] < 0:
                break
            chain.append(int(after[chain[-1]]))
        out.append(chain)
    return [chain for chain in out if len(chain) == len(FRAMES)]


def associated(folder: Path, cameras: list[Camera], tolerance_px: float) -> None:
    """How many of those particles `associate` joins again, from what each camera saw of them alone."""
    seen = np.stack(
        [theirs(folder, frame)[1][:, rows] for frame, rows in zip(FRAMES, np.array(chains(folder)).T, strict=True)], 2
    )
    whole = np.isfinite(seen).all(axis=(0, 2, 3))
    seen = seen[:, whole]
    n, m = seen.shape[1:3]
    rng = np.random.default_rng(0)
    orders = [rng.permutation(n) for _ in cameras]
    tracklets = [
        tracklets_of(
            np.repeat(np.arange(n), m), np.tile(np.arange(m), n), b[order].reshape(-1, 2), np.full((n * m, 2), 0.2)
        )
        for b, order in zip(seen, orders, strict=True)
    ]
    began = time.process_time()
    found = associate(cameras, tracklets, tolerance_px=tolerance_px)
    took = time.process_time() - began
    own = np.stack([t[np.argsort(order)] for t, order in zip(found.trajectory, orders, strict=True)])  # (4, n)
    same = (own >= 0) & (own == own[0])
    others = [len({k for c in range(4) for k in np.flatnonzero(own[c] == t)}) for t in range(found.m)]
    mixed = sum(k > 1 for k in others)
    left = {
        why: int(sum((r == why).sum() for r in found.reason)) for why in ("contested", "alone", "surplus", "mirror")
    }
    print(
        f"{n} particles that OpenPTV saw in four cameras and linked over {m} frames: {same.all(0).sum()} joined to the "
        f"same four, {((own >= 0).any(0) & ~same.all(0)).sum()} in part, {(own < 0).all(0).sum()} not at all; "
        f"{mixed} of {found.m} trajectories mix particles; apart: {left}; bias {found.bias_px:.2f} px; {took:.1f} s",
        flush=True,
    )


def compared(folder: Path, cameras: list[Camera]) -> None:
    for frame in FRAMES:
        place, b = theirs(folder, frame)
        located = locate_points(cameras, b, sd=0.2)
        off = np.linalg.norm(located.point - place, axis=-1)
        error = 1.4826 * np.nanmedian(np.abs(located.error))
        print(
            f"frame {frame}: {len(place)} particles of OpenPTV, located {np.isfinite(off).sum()}, "
            f"apart {np.nanmedian(off):.4f} mm (median), {np.nanpercentile(off, 90):.4f} (90 %), "
            f"reprojection {error:.3f} px (robust)",
            flush=True,
        )


PAIRS = list(combinations(range(4), 2))


def nearest(cameras: list[Camera], b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean (n, 3) of the points nearest to each pair of lines of sight, and their misses (6, n), mm, signed."""
    both = zip(cameras, np.nan_to_num(b), strict=True)
    rays = [paths(camera.through, camera.position, directions(camera, own))[-1] for camera, own in both]
    middles, misses = [], []
    for i, j in PAIRS:
        p, u, q, v = rays[i].q.T, rays[i].d.T, rays[j].q.T, rays[j].d.T
        across = np.cross(u, v)
        size = (across**2).sum(-1)
        apart = q - p
        on_first = p + u * ((np.cross(apart, v) * across).sum(-1) / size)[:, None]
        on_second = q + v * ((np.cross(apart, u) * across).sum(-1) / size)[:, None]
        unseen = ~np.isfinite(b[[i, j], :, 0]).all(0)
        middles.append(np.where(unseen[:, None], np.nan, (on_first + on_second) / 2))
        misses.append(np.where(unseen, np.nan, (apart * across).sum(-1) / np.sqrt(size)))
    return np.nanmean(middles, axis=0), np.array(misses)


def turned(cameras: list[Camera], b: np.ndarray) -> list[Camera]:
    """The cameras, each turned, shifted and its centre and f changed a little, so that lines of sight meet."""
    usual = np.array([0.03, 0.03, 0.03, 30.0, 30.0, 30.0, 200.0, 200.0, 20.0])  # rad, mm, px, mm: how much is likely

    def moved(x: np.ndarray) -> list[Camera]:
        out = []
        for camera, step in zip(cameras, x.reshape(4, 9) * usual, strict=True):
            R = Rotation.from_rotvec(step[:3]).as_matrix() @ camera.R
            place = camera.position + step[3:6]
            more = {"Cx": camera.Cx + step[6], "Cy": camera.Cy + step[7], "f": camera.f + step[8]}
            out.append(camera.with_(R=R, T=-R @ place, **more))
        return out

    def left(x: np.ndarray) -> np.ndarray:
        return np.concatenate([np.clip(nearest(moved(x), b)[1], -3, 3).ravel() / 0.03, x])

    return moved(least_squares(left, np.zeros(36), loss="soft_l1", max_nfev=60).x)


def refined(folder: Path, cameras: list[Camera]) -> list[Camera]:
    """The cameras as the matches of the first two frames have them; prints what is left in the others."""
    seen = []
    for frame in FRAMES:
        place, b = theirs(folder, frame)
        middle, _ = nearest(cameras, b)
        off = np.linalg.norm(middle - place, axis=-1)
        print(f"frame {frame}: means of the nearest points are {np.nanmedian(off):.4f} mm (median) from OpenPTV's")
        seen.append(b[:, np.isfinite(b).all((0, 2))])
    own, others = np.concatenate(seen[:2], axis=1), np.concatenate(seen[2:], axis=1)
    found = turned(cameras, own)
    for name, several in (("as they are", cameras), ("turned", found)):
        miss = np.median(np.abs(nearest(several, others)[1]), axis=1)
        print(f"lines of sight of the other two frames, cameras {name}, miss by {np.round(miss, 3)} mm (median, pairs)")
    return found


def followed(folder: Path) -> None:
    """How many particles of the first camera's pictures the track stage follows over three of the five or more."""
    from vidtrack.stages.track import track

    pictures = [cv2.imread(str(folder / f"img_2/cam1_{n}.tif"), cv2.IMREAD_GRAYSCALE) for n in range(10000, 10005)]
    info = VideoInfo(*SIZE, Fraction(10), field_order="progressive")
    frames = [Frame(k, Fraction(k, 10), p, False, None) for k, p in enumerate(pictures)]
    began = time.process_time()
    table = track(frames, info, targets="all", box=(16, 16), min_pixels=4).tracklets
    took = time.process_time() - began
    n = int((table.groupby("tracklet")["frame"].size() >= 3).sum())
    print(f"cam1: {n} tracklets of 3 frames or more, {took:.1f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--follow", action="store_true", help="the first camera's pictures through the track stage too")
    parser.add_argument("--tolerance", type=float, default=3.0, help="px that the calibration may leave")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as to:
        cameras = [camera_of(calibration(args.folder, to), i) for i in range(1, 5)]
    compared(args.folder, cameras)
    associated(args.folder, cameras, args.tolerance)
    associated(args.folder, refined(args.folder, cameras), args.tolerance)
    if args.follow:
        followed(args.folder)


if __name__ == "__main__":
    main()

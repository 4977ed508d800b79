"""OpenPTV's test cavity: four cameras look through glass into water with hundreds of particles a frame, five frames.

    git clone https://github.com/OpenPTV/test_cavity
    python benchmarks/cavity.py test_cavity

1. OpenPTV's own detections (commit ec0043c has them and its results): the four detections that it joins to one particle
   located by vidtrack, against its own place.
2. The pictures of img_2 followed by the track stage, joined over the cameras by `associate`, and how many of the
   trajectories lie on particles that OpenPTV found in that frame.
"""

from __future__ import annotations

import argparse
import subprocess
import time
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np

from vidtrack.association.associate import associate
from vidtrack.association.tracklets import tracklets_of
from vidtrack.exchange.cameras.given import Said
from vidtrack.exchange.cameras.openptv import read
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.views import by_trajectory
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


def followed(folder: Path, cameras: list[Camera], most: int) -> None:
    from vidtrack.stages.track import track

    tracklets = []
    for i in range(1, 5):
        pictures = [
            cv2.imread(str(folder / f"img_2/cam{i}_{n}.tif"), cv2.IMREAD_GRAYSCALE) for n in range(10000, 10005)
        ]
        assert all(p is not None for p in pictures), "img_2 is missing"
        info = VideoInfo(*SIZE, Fraction(10), field_order="progressive")
        frames = [Frame(k, Fraction(k, 10), p, False, None) for k, p in enumerate(pictures)]
        began = time.process_time()
        table = track(frames, info, targets=most or "all", box=(16, 16), min_pixels=4).tracklets
        took = time.process_time() - began
        keep = table[table.groupby("tracklet")["frame"].transform("size") >= 3]
        number = np.unique(keep["tracklet"], return_inverse=True)[1]
        tracklets.append(
            tracklets_of(
                number, keep["frame"].to_numpy(), keep[["Xf", "Yf"]].to_numpy(), keep[["sd_x", "sd_y"]].to_numpy()
            )
        )
        print(f"cam{i}: {tracklets[-1].n} tracklets of 3 frames or more, {took:.1f} s", flush=True)
    began = time.process_time()
    found = associate(cameras, tracklets, tolerance_px=12.0)  # OpenPTV's own matches leave 3.4 px
    print(f"associated to {found.m} trajectories in {time.process_time() - began:.1f} s, bias {found.bias_px:.2f} px")
    b, sd = [], []
    for t, own in zip(tracklets, found.trajectory, strict=True):
        piece = np.full((t.n, 5), -1)
        piece[t.owner, t.sample] = t.owner
        where, spread = np.full((t.n, 5, 2), np.nan), np.full((t.n, 5, 2), np.nan)
        where[t.owner, t.sample], spread[t.owner, t.sample] = t.b, t.sd
        b.append(by_trajectory(where, piece, own, found.m))
        sd.append(by_trajectory(spread, piece, own, found.m))
    sd = np.hypot(np.nan_to_num(np.stack(sd), nan=1.0), found.bias_px)
    located = locate_points(cameras, np.stack(b), sd=sd, reject=12.0)
    for k, frame in enumerate(FRAMES, 1):
        place, _ = theirs(folder, frame)
        own = located.point[:, k][np.isfinite(located.point[:, k, 0])]
        near = np.linalg.norm(own[:, None] - place, axis=-1).min(axis=1)
        by = np.bincount(located.n_cameras[:, k], minlength=5)[2:]
        print(
            f"frame {frame}: {len(own)} located (by 2, 3, 4 cameras: {by.tolist()}), {(near < 1.0).sum()} of them "
            f"within 1 mm of one of OpenPTV's {len(place)}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--targets", type=int, default=0, help="how many are followed; 0: all that move")
    args = parser.parse_args()
    cameras = [camera_of(args.folder, i) for i in range(1, 5)]
    compared(args.folder, cameras)
    followed(args.folder, cameras, args.targets)


if __name__ == "__main__":
    main()

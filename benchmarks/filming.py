"""The numbers of docs/filming.md, from the simulator: what size, light, exposure and angles cost.

    PYTHONPATH=. python benchmarks/filming.py [--balls 200]

Balls are drawn at places that are no whole pixels, seen through the lens's blur and the sensor's noise, and measured by
the code that measures them in recordings; what is printed is the root mean square of the errors of one coordinate. The
angle between two cameras and the number of points are by covariance (`vidtrack plan`).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from vidtrack.geometry.triangulate import locate_points
from vidtrack.planning.sensitivity_plan import read_sensitivity
from vidtrack.simulate.picture import Picture, developed, empty_scene, paint
from vidtrack.simulate.render import softened
from vidtrack.simulate.rig import look_at, thesis_rig
from vidtrack.stages.sensitivity import sensitivity
from vidtrack.tracking.detection.blobs import find_blobs

SIZE, EVERY = (480, 480), 48
PLAN = Path(__file__).parents[1] / "data/sensitivity/thesis.yaml"


def errors(n: int, *, diameter: float = 8.0, streak: float = 0.0, **picture: float) -> np.ndarray:
    """Errors (m, 2), px, of the centroids of about n balls.

    streak  px by which a ball moves to the right while the shutter is open; its place is that of the middle
    """
    rng = np.random.default_rng(5)
    look = Picture(**{"contrast": 200.0, "noise": 3.0, "blur_px": 0.6, "background": 24.0, **picture})
    angle = 2 * np.pi * np.arange(4000) / 4000
    circle = diameter / 2 * np.stack([np.cos(angle), np.sin(angle)], -1)
    found = []
    while len(found) < n:
        scene = empty_scene(look, SIZE)
        grid = np.arange(EVERY / 2, SIZE[0] - EVERY / 2 + 1, EVERY)
        at = np.stack([v.ravel() for v in np.meshgrid(grid, grid)], -1) + rng.uniform(-0.5, 0.5, (len(grid) ** 2, 2))
        stations = np.linspace(-streak / 2, streak / 2, max(1, int(4 * streak)) | 1)
        moved = at[:, None, None, :] + circle[None, None] + np.stack([stations, 0 * stations], -1)[None, :, None, :]
        patches = softened(moved, look.blur_px)
        for share, left, top in zip(*patches, strict=True):
            paint(scene, share, int(left), int(top), look.background + look.contrast)
        blobs = find_blobs(developed(look, scene, 0.0, rng), min_pixels=4)
        where = np.stack([blobs.Xf, blobs.Yf], -1)
        if not len(where):
            return np.full((1, 2), np.nan)
        away = where[:, None] - at[None]
        near = np.abs(away).max(-1).argmin(0)
        own = where[near] - at
        found += [e for e in own if np.abs(e).max() < EVERY / 2]
        if not found:
            return np.full((1, 2), np.nan)
    return np.array(found)


def rms(e: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(e**2, axis=0))


def angle_between(degrees: float) -> np.ndarray:
    """sigma (across, depth) in space over that of cameras at right angles, two cameras at this angle."""
    a = thesis_rig(1)[0].with_(kappa1=0.0)
    half = np.radians(degrees) / 2
    cameras = []
    for side in (-half, half):
        position = 160 * np.array([np.sin(side), -np.cos(side), 0.0])
        R = look_at(position, [0, 0, 0])
        cameras.append(a.with_(R=R, T=-R @ position))
    middle = [[camera.Cx, camera.Cy] for camera in cameras]
    return locate_points(cameras, np.array(middle), sd=0.1).sigma[:2]


def main(n: int) -> None:
    print("diameter, px: rms error, px")
    for diameter in (2.5, 3, 4, 5, 8, 12, 16):
        print(f"  {diameter:4}: {rms(errors(n, diameter=diameter)).mean():.3f}")
    print("contrast, grey levels (noise 3, 8 px): rms error")
    for contrast in (20, 30, 60, 100, 200):
        print(f"  {contrast:4}: {rms(errors(n, contrast=contrast)).mean():.3f}")
    print("noise, grey levels (contrast 200, 8 px): rms error")
    for noise in (1, 3, 6, 12):
        print(f"  {noise:4}: {rms(errors(n, noise=noise)).mean():.3f}")
    print("exposure: brightest level over full scale (8 px, noise 3): rms error")
    for share in (0.5, 0.9, 1.2, 2, 4):
        print(f"  {share:4}: {rms(errors(n, contrast=share * 255 - 24)).mean():.3f}")
    print("blur, px sigma (8 px): rms error")
    for blur in (0.2, 0.6, 1, 2):
        print(f"  {blur:4}: {rms(errors(n, blur_px=blur)).mean():.3f}")
    print("motion while the shutter is open, diameters (8 px): rms error along, across")
    for streak in (0, 0.5, 1):
        print(f"  {streak:4}: {rms(errors(n, streak=8 * streak))[0]:.3f}, {rms(errors(n, streak=8 * streak))[1]:.3f}")
    right = angle_between(90)
    print("angle between two cameras: error across, in depth, over those at 90 degrees")
    for degrees in (10, 20, 30, 60, 90, 120):
        across, depth = angle_between(degrees) / right
        print(f"  {degrees:4}: {across:.2f}, {depth:.2f}")
    plan, cases = read_sensitivity(str(PLAN))
    table = sensitivity(cases, trials=0, seed=plan.seed).table
    print("the thesis's rig with one thing changed: mean error in space over that of the rig as it is")
    for _, row in table.iterrows():
        print(f"  {row['sweep']} = {row['value']}: {row['mean_3d'] / table['mean_3d'].iloc[0]:.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--balls", type=int, default=200)
    main(parser.parse_args().balls)

"""A folder of the old programs: two cameras, their points, and a float that was plucked; the truth beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.exchange.thesis.rig import FIXED, cameras, points
from vidtrack.exchange.thesis.camparm import Camparm, write_camparm
from vidtrack.exchange.thesis.outcam import outcam_of, write_outcam
from vidtrack.exchange.thesis.points import Sighted, Survey, write_sighted, write_targets
from vidtrack.exchange.thesis.tracks import write_taped
from vidtrack.geometry.camera import project

CODES = [f"10:00:{55 + 2 * k // 30:02d}:{2 * k % 30:02d}" for k in range(60)]


def moving():
    """Where the target is at CODES, (60, 3) inches."""
    t = np.arange(60) * 2 * 1.001 / 30
    swing = np.exp(-0.28 * t) * np.cos(2 * np.pi * 0.9 * t)
    return np.stack([30 + 10 * swing, 20 + 0 * t, 10 + 3 * np.sin(np.pi * t)], -1)


def write_old(folder: Path, noise: float = 0.1, seed: int = 0) -> None:
    """camparm.dat, balls.dat, cam1.prn, cam2.prn, outcam1.prn, outcam2.prn, cam1vid.prn, cam2vid.prn."""
    rng = np.random.default_rng(seed)
    p = points(31, 7)
    tags = tuple(str(k) for k in range(1, 32))
    write_camparm(folder / "camparm.dat", Camparm((FIXED, FIXED), (148.2, 151.7)))
    write_targets(folder / "balls.dat", Survey(tags, p))
    for k, camera in enumerate(cameras(), 1):
        b = project(camera, p) + rng.normal(0, noise, (31, 2))
        write_sighted(folder / f"cam{k}.prn", Sighted(tags, b, np.full(31, 30.0), p), f"cam{k}.prn")
        write_outcam(folder / f"outcam{k}.prn", outcam_of(camera, p).out, f"outcam{k}.prn")
        b = project(camera, moving()) + rng.normal(0, noise, (60, 2))
        write_taped(folder / f"cam{k}vid.prn", CODES, b[:, None])

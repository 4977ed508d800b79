"""How long 100,000 frames of 20 points take to be read, beside pandas, which only parses their numbers.

PYTHONPATH=. python benchmarks/import_tracks.py
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from fractions import Fraction

import h5py
import numpy as np
import pandas as pd

from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks
from vidtrack.stages.import_tracks import import_tracks
from vidtrack.timing.timebase import time_base

FRAMES, POINTS = 100_000, 20


def main() -> None:
    """Print seconds of processor time, the best of three, and their ratio to pandas."""
    t = np.arange(FRAMES)[:, None, None] / 100
    b = 500 + 300 * np.sin(t + np.arange(2 * POINTS).reshape(POINTS, 2)) + np.random.default_rng(0).normal(0, 0.1)
    with tempfile.TemporaryDirectory() as folder:
        table, analysis = os.path.join(folder, "cam1.csv"), os.path.join(folder, "cam1.h5")
        names = [f"pt{i + 1}_cam1_{axis}" for i in range(POINTS) for axis in "UV"]
        pd.DataFrame(b.reshape(FRAMES, -1), columns=names).to_csv(table, index=False, float_format="%.6f")
        with h5py.File(analysis, "w") as file:
            file["tracks"] = np.transpose(b[None], (0, 3, 2, 1))
            file["node_names"] = np.array([f"n{i}" for i in range(POINTS)], "S")
        said = Convention(first=(1.0, 1.0))
        peer = timed(lambda: pd.read_csv(table))
        csv = timed(lambda: placed(read_tracks(table, said, "here"), said, "here"))
        hdf = timed(lambda: placed(read_tracks(analysis, said, "here"), said, "here"))
        tracks = read_tracks(table, said, "here")
        stage = timed(
            lambda: import_tracks(
                tracks.names, tracks.frame, tracks.b, time_base(Fraction(100)), named=True, camera="cam1"
            )
        )
    print(f"pandas.read_csv           {peer:.2f} s")
    print(f"xypts of DLTdv 8, read    {csv:.2f} s   {csv / peer:.2f} of pandas")
    print(f"analysis of SLEAP, read   {hdf:.2f} s   {hdf / peer:.2f} of pandas")
    print(f"tables of 2,000,000 rows  {stage:.2f} s")


def timed(work: Callable[[], object]) -> float:
    """Seconds of processor time, the best of three."""
    best = np.inf
    for _ in range(3):
        begun = time.process_time()
        work()
        best = min(best, time.process_time() - begun)
    return float(best)


if __name__ == "__main__":
    main()

"""Tracks of which every test file is made, in frame-buffer px, and the words of each program's files."""

from __future__ import annotations

import numpy as np

SIZE = (640, 480)


def positions(k: int = 40, n: int = 2, seed: int = 1):
    """(k, n, 2) px, smooth and noisy by 0.1 px, with two gaps."""
    rng = np.random.default_rng(seed)
    t = np.arange(k)[:, None]
    x = 320 + 150 * np.cos(0.11 * t + np.arange(n)) + rng.normal(0, 0.1, (k, n))
    y = 200 + 100 * np.sin(0.07 * t + 2 * np.arange(n)) + rng.normal(0, 0.1, (k, n))
    b = np.stack([x, y], -1)
    b[5:8, 0] = np.nan
    return b


def dltdv(b, *, letters="XY", names=None, origin="upper-left", camera="_cam2", other="_cam1", first=(1, 1)) -> str:
    """An xypts table of two cameras, ours the second: as sprintf('%.6f') prints it."""
    names = names or [f"pt{i + 1}" for i in range(b.shape[1])]
    own = b + first
    if origin == "lower-left":
        own[..., 1] = SIZE[1] - 1 - b[..., 1] + first[1]
    head = ",".join(f"{name}{c}_{letter}" for name in names for c in (other, camera) for letter in letters)
    rows = []
    for row in own:
        rows.append(",".join("{:.6f},{:.6f}".format(*pair) for at in row for pair in ((1.0, 2.0), tuple(at))))
    return "\n".join([head, *rows, ""]).replace("nan", "NaN")


def sparse(b, *, cameras=3, camera=2, first=(1, 1)) -> str:
    """DLTdv's sparse xypts of several cameras, of which one is ours and camera 1 has a point in every frame."""
    k, n = b.shape[:2]
    full = np.full((k, n, cameras, 2), np.nan)
    full[:, :, camera - 1] = b + first
    full[:, :, 0] = 7.0
    flat = full.reshape(k, -1)
    rows, columns = np.nonzero(np.isfinite(flat))
    lines = [
        f"{i + 1}\t{j + 1}\t{flat[i, j]:.6f}" for i, j in sorted(zip(rows, columns, strict=True), key=lambda p: p[::-1])
    ]
    head = ["Sparse format camera coordinates file", f"{k}\t{flat.shape[1]}\t{len(lines)}"]
    return "\n".join([*head, *lines, ""])

"""The rendered gauntlet: scenes drawn as pictures, tracked by the track stage, located by the locate stage.

    python benchmarks/rendered.py --seeds 2 [--kind NAME ...] [--scenes]

For each kind: the share located of the samples that two cameras saw, IDF1, fixes beyond five sigma in any coordinate,
z (rms of error over sigma of the fixes within the gate), the share of samples measured of those that a camera saw, and
rows of targets that lie on no ball (0.3 px and 5 sd away) with an empty flag. See rendered_scenes and gauntlet_metrics.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple

import cv2
import numpy as np
import pandas as pd
from gauntlet_metrics import Counts, counted, together
from rendered_scenes import LOOKS, Scene, Shot, scene

from vidtrack.arrays import Array, Bools
from vidtrack.errors import VidtrackError
from vidtrack.stages.locate import locate
from vidtrack.stages.track import Tracked, track


class Outcome(NamedTuple):
    """One scene."""

    kind: str
    seed: int
    counts: Counts
    z: float
    measured: float  # of what the cameras saw
    strange: int  # measured in no ball, empty flag
    rows: int
    seconds: float
    message: str


def tracked(s: Scene, shot: Shot) -> Tracked:
    boxes = None
    names: int | list[str] = s.targets
    if shot.box is not None:
        names = [f"t{i + 1}" for i in range(s.targets)]
        boxes = pd.DataFrame(shot.box, columns=["Xf", "Yf", "width", "height"]).assign(target=names)
    return track(
        shot.frames(), shot.info, targets=names, start_boxes=boxes, polarity="dark" if s.dark else "bright"
    )  # fmt: skip


def located(s: Scene, found: list[Tracked]) -> tuple[Array, Array, Array]:
    """Moments, positions and sigma."""
    names = [shot.camera.name for shot in s.shots]
    cameras = {shot.camera.name: (shot.camera, None) for shot in s.shots}
    clocks = {names[1]: "auto"} if s.look.offset else None
    table = locate(
        dict(zip(names, (one.centroids for one in found), strict=True)),
        cameras,
        targets=s.targets if s.known else None,
        tracklets=dict(zip(names, (one.tracklets for one in found), strict=True)),
        kept=dict(zip(names, (one.windows for one in found), strict=True)),
        clocks=clocks,
    ).trajectories
    at, moment = np.unique(table["time_s"], return_inverse=True)
    target, _ = pd.factorize(table["target"])
    fix, sigma = (np.full((target.max(initial=-1) + 1, at.size, 3), np.nan) for _ in range(2))
    fix[target, moment] = table[["x", "y", "z"]]
    sigma[target, moment] = table[["sigma_x", "sigma_y", "sigma_z"]]
    return at, fix, sigma


def outcome(kind: str, seed: int) -> Outcome:
    """Draw, track and locate one scene."""
    s = scene(kind, seed)
    start = time.process_time()
    found = [tracked(s, shot) for shot in s.shots]
    try:
        at, fix, sigma = located(s, found)
        message = ""
    except VidtrackError as error:
        at, message = s.shots[0].t, str(error)
        fix = sigma = np.full((1, at.size, 3), np.nan)
    seconds = time.process_time() - start
    truth, present, others = s.truth(at), s.present(at), s.others(at)
    every = np.concatenate([truth, others])
    there = np.concatenate([present, np.ones(others.shape[:2], bool)])
    wanted = np.concatenate([wanted_of(s, at), np.zeros(others.shape[:2], bool)])
    counts = counted(every, wanted, there, fix, sigma, s.diameter)
    share, strange, rows = _views(s, found)
    return Outcome(kind, seed, counts, _z(every, fix, sigma, s.diameter), share, strange, rows, seconds, message)


def wanted_of(s: Scene, at: Array) -> Bools:
    """Samples (K, m) of targets that two cameras saw just then, or just before and after."""
    out = np.zeros((s.targets, at.size), int)
    for shot in s.shots:
        step = 1e-6 * (shot.t[1] - shot.t[0])
        before = np.searchsorted(shot.t, at + step) - 1
        after = np.searchsorted(shot.t, at - step)
        inside = (before >= 0) & (after < shot.t.size)
        out += shot.seen[:, np.maximum(before, 0)] & shot.seen[:, np.minimum(after, shot.t.size - 1)] & inside
    return np.asarray(out >= 2)


def _z(truth: Array, fix: Array, sigma: Array, gate: float) -> float:
    """rms of error over sigma of the fixes that are near a target, its outer hundredth left out."""
    out = []
    for own, sd in zip(fix, sigma, strict=True):
        off = np.linalg.norm(truth - own, axis=-1)
        near = np.nanargmin(np.where(np.isfinite(off), off, np.inf), axis=0)
        e = own - truth[near, np.arange(len(own))]
        ok = np.linalg.norm(e, axis=-1) < gate
        out.append((e / sd)[ok].ravel())
    z2 = np.concatenate(out) ** 2 if out else np.zeros(0)
    return float(np.sqrt(z2[z2 <= np.quantile(z2, 0.99)].mean())) if z2.size else np.nan


def _views(s: Scene, found: list[Tracked]) -> tuple[float, int, int]:
    """Share measured of what cameras saw; rows with an empty flag that lie on no ball, and all rows."""
    seen = measured = strange = rows = 0
    for shot, one in zip(s.shots, found, strict=True):
        table = pd.concat([one.centroids, one.tracklets], ignore_index=True)
        table = table[table["Xf"].notna()]
        step = 2 if s.look.interlaced else 1
        sample = table["frame"].to_numpy() * step + (table["field"] == "bottom").to_numpy()
        at, sd = table[["Xf", "Yf"]].to_numpy(), table[["sd_x", "sd_y"]].to_numpy()
        off = np.abs(shot.place[:, sample] - at)  # (K, rows, 2)
        near = np.linalg.norm(off, axis=-1)
        best = near.argmin(axis=0)
        hit = np.zeros(shot.seen.shape, bool)
        good = near.min(axis=0) < 3
        hit[best[good], sample[good]] = True
        seen += int(shot.seen.sum())
        measured += int((hit & shot.seen).sum())
        own = one.centroids[one.centroids["Xf"].notna()]
        k = len(own)
        empty = (table["flag"] == "").to_numpy()[:k]
        off_own = off[best[:k], np.arange(k)]
        far = ((off_own > 5 * sd[:k]) & (off_own > 0.3)).any(axis=-1)
        strange += int((empty & far).sum())
        rows += k
    return measured / max(seen, 1), strange, rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", nargs="*", default=list(LOOKS))
    parser.add_argument("--scenes", action="store_true", help="a line for each scene that is not whole")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"{'kind':22} {'located %':>9} {'IDF1':>7} {'false':>6} {'fixes':>7} {'worst %':>8} {'z':>5} "
          f"{'measured %':>10} {'strange':>7} {'of':>7} {'s':>6}", flush=True)  # fmt: skip
    every = []
    for kind in args.kind:
        own = [outcome(kind, seed) for seed in range(args.first, args.first + args.seeds)]
        every += own
        print_row(kind, own)
        for o in own if args.scenes else []:
            c = o.counts
            if c.share < 0.99 or c.idf1 < 0.99 or c.false or o.strange or o.message:
                print(f"    seed {o.seed}: located {100 * c.share:.2f} % of {c.wanted}, IDF1 {c.idf1:.4f}, {c.false} "
                      f"false of {c.fixes}, measured {100 * o.measured:.1f} %, strange {o.strange} {o.message}",
                      flush=True)  # fmt: skip
    print_row("all", every)


def print_row(kind: str, own: list[Outcome]) -> None:
    """A line of the table."""
    total = together([o.counts for o in own])
    print(
        f"{kind:22} {100 * total.share:9.3f} {total.idf1:7.4f} {total.false:6d} {total.fixes:7d} "
        f"{100 * min(o.counts.share for o in own):8.2f} {np.nanmedian([o.z for o in own]):5.2f} "
        f"{100 * np.mean([o.measured for o in own]):10.2f} {sum(o.strange for o in own):7d} "
        f"{sum(o.rows for o in own):7d} {sum(o.seconds for o in own):6.1f}",
        flush=True,
    )


if __name__ == "__main__":
    main()

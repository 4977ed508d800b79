"""The gauntlet: random scenes, from trajectories in space to tracklets and back.

    python benchmarks/gauntlet.py --seeds 8 [--kind NAME ...] [--method association stage trackpy laptrack]

For each kind of scene: the share located of the samples that two cameras saw, IDF1, HOTA, fixes beyond five sigma, the
worst scene and the time that it takes. `association` is that alone, `stage` the whole stage locate, from tables as the
track stage writes them; scenes whose clocks are not locked always go through the stage, which seeks the clocks.
`trackpy` and `laptrack` are other programs on the same detections, see gauntlet_peers.
See gauntlet_scenes and gauntlet_metrics.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
import pandas as pd
from gauntlet_metrics import Counts, counted, together
from gauntlet_scenes import KINDS, Scene, View, scene

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.associate import associate
from vidtrack.geometry.triangulate import locate_points
from vidtrack.stages.locate import locate

METHODS = ("association", "stage", "trackpy", "laptrack")


class Outcome(NamedTuple):
    """One scene by one method."""

    kind: str
    seed: int
    counts: Counts
    seconds: float
    motmetrics: float | None  # IDF1 by py-motmetrics


def by_association(s: Scene) -> list[Ints]:
    """The trajectory of each tracklet, camera by camera."""
    cameras = [v.camera for v in s.views]
    return list(associate(cameras, [v.tracklets for v in s.views], targets=s.targets).trajectory)


def located_by_stage(s: Scene) -> tuple[Array, Array, Array]:
    """Moments, positions and sigma by stage locate itself, from tables as the track stage writes them.

    Clocks that are not locked are sought: each camera's own time begins at 0.
    """
    cameras, empty, tracklets = {}, {}, {}
    for v in s.views:
        name, t = v.camera.name, np.arange(v.t.size) / s.rate
        k = v.tracklets.owner
        b, sd = v.tracklets.b, v.tracklets.sd
        columns = {"tracklet": k, "time_s": t[v.tracklets.sample], "Xf": b[:, 0], "Yf": b[:, 1], "flag": ""}
        table = pd.DataFrame(columns | {"sd_x": sd[:, 0], "sd_y": sd[:, 1], "target": ""})
        cameras[name], tracklets[name] = (v.camera, None), table
        empty[name] = pd.DataFrame({"time_s": t, "target": "t1", "Xf": np.nan, "Yf": np.nan, "sd_x": np.nan})
        empty[name] = empty[name].assign(sd_y=np.nan, flag="lost")
    clocks = None if s.locked else {v.camera.name: "auto" for v in s.views[1:]}
    found = locate(empty, cameras, targets=s.targets, tracklets=tracklets, clocks=clocks)
    table = found.trajectories
    at, moment = np.unique(table["time_s"], return_inverse=True)
    target, _ = pd.factorize(table["target"])
    both = np.full((2, target.max(initial=-1) + 1, at.size, 3), np.nan)
    both[0, target, moment] = table[["x", "y", "z"]]
    both[1, target, moment] = table[["sigma_x", "sigma_y", "sigma_z"]]
    return at, both[0], both[1]


def put_together(views: list[View], trajectory: list[Ints]) -> tuple[Array, Array]:
    """What each camera saw of each trajectory, and its sd: (n_cameras, m, M, 2)."""
    m = 1 + max((int(t.max(initial=-1)) for t in trajectory), default=-1)
    b = np.full((len(views), m, views[0].t.size, 2), np.nan)
    sd = np.ones(b.shape)
    for i, (v, own) in enumerate(zip(views, trajectory, strict=True)):
        k = own[v.tracklets.owner]
        rows = np.flatnonzero(k >= 0)
        b[i, k[rows], v.tracklets.sample[rows]] = v.tracklets.b[rows]
        sd[i, k[rows], v.tracklets.sample[rows]] = v.tracklets.sd[rows]
    return b, sd


def wanted_of(s: Scene, at: Array) -> Bools:
    """Samples (K, m) of targets, at moments (m,), that two cameras measured: just then, or just before and after."""
    out = np.zeros((len(s.views[0].seen), at.size), int)
    for v in s.views:
        step = 1e-6 * (v.t[1] - v.t[0])
        before = np.searchsorted(v.t, at + step) - 1
        after = np.searchsorted(v.t, at - step)
        inside = (before >= 0) & (after < v.t.size)
        seen = v.seen[:, np.maximum(before, 0)] & v.seen[:, np.minimum(after, v.t.size - 1)]
        out += seen & inside
    return np.asarray(out >= 2)


def outcome(kind: str, seed: int, method: str, motmetrics: bool = False) -> Outcome:
    """Play one scene."""
    s = scene(kind, seed)
    start = time.process_time()
    if method in ("trackpy", "laptrack"):
        from gauntlet_peers import by_peers

        t, fix, sigma = by_peers(s, method)
    elif method == "stage" or not s.locked:
        t, fix, sigma = located_by_stage(s)
    else:
        b, sd = put_together(s.views, by_association(s))
        located = locate_points([v.camera for v in s.views], b, sd=sd, reject=3.0)
        t, fix, sigma = s.views[0].t, located.point, located.sigma
    seconds = time.process_time() - start
    truth, wanted, present = s.truth(t), wanted_of(s, t), s.present(t)
    counts = counted(truth, wanted, present, fix, sigma, s.diameter)
    return Outcome(
        kind, seed, counts, seconds, idf1_of_motmetrics(truth, wanted, fix, s.diameter) if motmetrics else None
    )


def idf1_of_motmetrics(truth: Array, wanted: Bools, fix: Array, gate: float) -> float:
    """IDF1 by py-motmetrics; fixes near a target that is not asked for just then are left out, as in `counted`."""
    import motmetrics as mm

    accumulator = mm.MOTAccumulator(auto_id=True)
    for moment in range(truth.shape[1]):
        own, found = np.flatnonzero(wanted[:, moment]), np.flatnonzero(np.isfinite(fix[:, moment, 0]))
        d = np.linalg.norm(truth[:, None, moment] - fix[None, found, moment], axis=-1)
        near_other = ((d <= gate) & ~wanted[:, moment, None]).any(0) & ~((d <= gate) & wanted[:, moment, None]).any(0)
        keep = ~near_other
        d = np.where(d[own][:, keep] <= gate, d[own][:, keep], np.nan)
        accumulator.update(own, found[keep], d)
    summary = mm.metrics.create().compute(accumulator, metrics=["idf1"], name="all")
    return float(summary["idf1"].iloc[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", nargs="*", default=list(KINDS))
    parser.add_argument("--method", nargs="*", default=["association"], choices=METHODS)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--motmetrics", action="store_true", help="IDF1 by py-motmetrics too (group bench)")
    parser.add_argument("--scenes", action="store_true", help="a line for each scene that is not whole")
    args = parser.parse_args()
    for method in args.method:
        seeds = range(args.first, args.first + args.seeds)
        jobs = [(kind, seed, method, args.motmetrics) for kind in args.kind for seed in seeds]
        if args.workers > 1:
            with ProcessPoolExecutor(args.workers) as pool:
                outcomes = list(pool.map(outcome, *zip(*jobs, strict=True)))
        else:
            outcomes = [outcome(*job) for job in jobs]
        print_row(method, args.kind, outcomes, args.scenes)


def print_row(method: str, kinds: list[str], outcomes: list[Outcome], scenes: bool) -> None:
    """The table."""
    head = (
        f"{'located %':>10} {'IDF1':>7} {'HOTA':>7} {'false':>6} {'fixes':>8} {'worst %':>8} {'below 97':>8} {'s':>7}"
    )
    print(f"{method:24} {head}")
    for kind in [*kinds, "all"]:
        own = [o for o in outcomes if kind in ("all", o.kind)]
        total = together([o.counts for o in own])
        shares = [o.counts.share for o in own]
        print(
            f"{kind:24} {100 * total.share:10.3f} {total.idf1:7.4f} {total.hota:7.4f} {total.false:6d} "
            f"{total.fixes:8d} {100 * min(shares):8.2f} {sum(x < 0.97 for x in shares):8d} "
            f"{sum(o.seconds for o in own):7.1f}"
        )
        if kind == "all" and all(o.motmetrics is not None for o in own):
            apart = max(abs(o.counts.idf1 - (o.motmetrics or 0.0)) for o in own)
            print(f"IDF1 by py-motmetrics differs by at most {apart:.1e} in any scene")
        if scenes and kind != "all":
            for o in own:
                c = o.counts
                if c.share < 0.995 or c.idf1 < 0.995 or c.false:
                    print(
                        f"    seed {o.seed}: located {100 * c.share:.2f} % of {c.wanted}, IDF1 {c.idf1:.4f}, "
                        f"HOTA {c.hota:.4f}, {c.false} false of {c.fixes}, {o.seconds:.1f} s"
                    )


if __name__ == "__main__":
    main()

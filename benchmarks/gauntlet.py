"""The gauntlet: random scenes, from trajectories in space to tracklets and back.

    python benchmarks/gauntlet.py --seeds 8 [--kind NAME ...] [--method NAME ...] [--workers 2]

For each kind of scene: the share located of the samples that two cameras saw, IDF1, HOTA, fixes beyond five sigma, the
worst scene and the time that association takes. See gauntlet_scenes and gauntlet_metrics.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
from gauntlet_metrics import Counts, counted, together
from gauntlet_scenes import KINDS, Scene, View, scene

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.association.associate import associate
from vidtrack.geometry.triangulate import locate_points


class Outcome(NamedTuple):
    """One scene by one method."""

    kind: str
    seed: int
    counts: Counts
    seconds: float


def by_association(s: Scene) -> list[Ints]:
    """The trajectory of each tracklet, camera by camera."""
    cameras = [v.camera for v in s.views]
    return list(associate(cameras, [v.tracklets for v in s.views], targets=s.targets).trajectory)


METHODS = {"association": by_association}


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


def wanted_of(s: Scene) -> Bools:
    """Samples (K, M) of targets that two cameras measured."""
    return np.asarray(np.sum([v.seen for v in s.views], 0) >= 2)


def outcome(kind: str, seed: int, method: str) -> Outcome:
    """Play one scene."""
    s = scene(kind, seed)
    start = time.process_time()
    trajectory = METHODS[method](s)
    seconds = time.process_time() - start
    b, sd = put_together(s.views, trajectory)
    t = s.views[0].t
    located = locate_points([v.camera for v in s.views], b, sd=sd, reject=3.0)
    truth, present = s.truth(t), s.present(t)
    counts = counted(truth, wanted_of(s), present, located.point, located.covariance, s.diameter)
    return Outcome(kind, seed, counts, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", nargs="*", default=list(KINDS))
    parser.add_argument("--method", nargs="*", default=["association"], choices=list(METHODS))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scenes", action="store_true", help="a line for each scene that is not whole")
    args = parser.parse_args()
    for method in args.method:
        seeds = range(args.first, args.first + args.seeds)
        jobs = [(kind, seed, method) for kind in args.kind for seed in seeds]
        if args.workers > 1:
            with ProcessPoolExecutor(args.workers) as pool:
                outcomes = list(pool.map(outcome, *zip(*jobs, strict=True)))
        else:
            outcomes = [outcome(*job) for job in jobs]
        told(method, args.kind, outcomes, args.scenes)


def told(method: str, kinds: list[str], outcomes: list[Outcome], scenes: bool) -> None:
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

"""How long association takes: 60 targets, 4 cameras, up to 10,000 samples.

    python benchmarks/association.py [--samples 2500 10000] [--profile]

Processor time of `associate` alone, on tracklets as the gauntlet's model of a follower makes them, of targets of 0.4,
1.5 and 4 px radius (`apart`, `spread`, `crowd`): the larger, the more meetings cut their tracks. Beside it that
of a yardstick just before and after: plain numpy finds for every detection the smallest epipolar miss in every other
camera, which is the least that anything may do. The ratio of the two hardly depends on what else the computer does,
as either time does. Last the share of the samples whose trajectory shows most of all their own target.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time
from dataclasses import replace
from itertools import combinations

import gauntlet_scenes
import numpy as np
from gauntlet_scenes import CLUTTER, KINDS, Plan, Scene, scene

from vidtrack.association.associate import associate
from vidtrack.geometry.epipolar import epipolar_distance

PLANS = {
    "apart": Plan(targets=(60, 60), cameras=(4, 4), radius=0.4),
    "spread": Plan(targets=(60, 60), cameras=(4, 4), radius=1.5),
    "crowd": KINDS["sixty"],
}


def scene_of(kind: str, samples: int, seed: int) -> Scene:
    plan = replace(PLANS[kind], samples=(samples, samples))
    gauntlet_scenes.KINDS[f"{kind} {samples}"] = plan
    return scene(f"{kind} {samples}", seed)


def right(s: Scene, trajectory: list[np.ndarray]) -> float:
    """Share of the samples of targets' tracklets whose trajectory is that of most of its samples of one target."""
    votes = np.zeros((1 + max(int(t.max(initial=-1)) for t in trajectory), 1 + max(v.owner.max() for v in s.views)))
    total = 0
    for view, own in zip(s.views, trajectory, strict=True):
        n = np.diff(view.tracklets.start)
        real = view.owner != CLUTTER
        total += int(n[real].sum())
        real &= own >= 0
        np.add.at(votes, (own[real], view.owner[real]), n[real])
    return float(votes.max(axis=1).sum() / total)


def yardstick(s: Scene) -> float:
    """Seconds of plain numpy for the smallest epipolar miss of every detection in every other camera."""
    moments = s.views[0].t.size
    rows = []
    for v in s.views:
        t = v.tracklets
        order = np.argsort(t.sample, kind="stable")
        rows.append((t.b[order], np.searchsorted(t.sample[order], np.arange(moments + 1))))
    began = time.process_time()
    for (a, one), (b, other) in combinations(zip(s.views, rows, strict=True), 2):
        for k in range(moments):
            i, j = (seen[edges[k] : edges[k + 1]] for seen, edges in (one, other))
            if len(i) and len(j):
                np.abs(epipolar_distance(a.camera, b.camera, i[:, None], j[None])).min(axis=1)
    return time.process_time() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, nargs="*", default=[2500, 10000])
    parser.add_argument("--kind", nargs="*", default=["apart", "spread"], choices=PLANS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--profile", action="store_true")
    args = parser.parse_args()
    for kind in args.kind:
        for samples in args.samples:
            s = scene_of(kind, samples, args.seed)
            tracklets = [v.tracklets for v in s.views]
            profile = cProfile.Profile(time.process_time)
            plain = yardstick(s)
            began = time.process_time()
            if args.profile:
                profile.enable()
            found = associate([v.camera for v in s.views], tracklets, targets=s.targets)
            profile.disable()
            took = time.process_time() - began
            plain = (plain + yardstick(s)) / 2
            print(
                f"{kind:8} {samples:6d} samples {sum(t.n for t in tracklets):6d} tracklets {took:7.2f} s  "
                f"yardstick {plain:6.2f} s  ratio {took / plain:5.2f}  right {right(s, found.trajectory):.5f}",
                flush=True,
            )
            if args.profile:
                pstats.Stats(profile).sort_stats("cumtime").print_stats(35)


if __name__ == "__main__":
    main()

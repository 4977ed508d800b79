"""Random experiments with one spoiled circumstance each, processed and judged against the truth.

    python -m benchmarks.campaign [--seed 1] [--count 300] [--kind none --kind camera-rolled] [--keep FOLDER]

A third of the experiments is unspoiled. For each: whether it was called good; the share of samples with an empty flag
and a verdict of `good` that are off by more than 5 sigma (of any axis) and more than 0.5 px worth of space; whether
the messages name what is wrong. `right` counts spoiled experiments that are called doubtful, bad, failed or refused
with the cause named, and harmless ones of which every number is right.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from benchmarks.campaign.circumstances import CIRCUMSTANCES
from benchmarks.campaign.one_process import Outcome, process
from benchmarks.campaign.scenes import SIZE, random_scene
from vidtrack.simulate.laboratory import set_up
from vidtrack.simulate.scenario import scenario_from

WRONG_SIGMAS, WRONG_PX = 5.0, 0.5
START_S = 36000.0
"""s, 10:00:00:00: when runs begin."""


class Trial(NamedTuple):
    kind: str
    seed: int
    verdict: str  # good, doubtful, bad, failed, refused
    named: bool
    samples: int  # with an empty flag
    wrong: int
    located: float  # of all samples
    worst: float  # largest error of an unflagged sample, in
    messages: str


def trial(kind: str, seed: int, keep: str | None = None) -> Trial:
    """One experiment from its seed to its score."""
    rng = np.random.default_rng([seed, len(kind), *kind.encode()])
    scene, circumstance = random_scene(rng), CIRCUMSTANCES[kind]
    circumstance.before(scene, rng)
    room = Path(keep) if keep else Path(tempfile.mkdtemp(prefix="campaign-"))
    folder = room / f"{kind}-{seed}"
    try:
        set_up(scenario_from(scene, "scenario"), str(folder), threads=1)
        truth = pd.read_csv(folder / "runs/test/truth.csv")
        (folder / "runs/test/truth.csv").unlink()
        circumstance.after(folder, rng)
        return _scored(kind, seed, process(folder), folder, truth, scene)
    finally:
        if not keep:
            shutil.rmtree(room)


def _scored(kind: str, seed: int, outcome: Outcome, folder: Path, truth: pd.DataFrame, scene: dict[str, Any]) -> Trial:
    reasons = list(_reasons(outcome.verdict))
    text = " | ".join([*outcome.refused, *outcome.failed, *reasons])
    words = [_word(outcome.verdict, part) for part in ("calibration", "runs")]
    order = ("good", "doubtful", "bad", "failed")
    verdict = "refused" if outcome.refused else max(words, key=lambda w: order.index(w) if w in order else 3)
    named = bool(CIRCUMSTANCES[kind].named and re.search(CIRCUMSTANCES[kind].named, text, re.IGNORECASE))
    path = folder / "results/runs/test/trajectories.parquet"
    samples, wrong, located, worst = (
        _errors(pd.read_parquet(path), truth, scene) if path.is_file() else (0, 0, 0.0, 0.0)
    )
    return Trial(kind, seed, verdict, named, samples, wrong, located, worst, text)


def _word(verdict: Any, part: str) -> str:
    own = verdict.get(part) or {}
    return str(own["test"]["verdict"] if part == "runs" and "test" in own else own.get("verdict", "failed"))


def _reasons(verdict: Any) -> Iterator[str]:
    if isinstance(verdict, dict):
        for key, value in verdict.items():
            if key in ("reasons", "notes"):
                yield from (str(reason) for reason in value)
            elif key != "provenance":
                yield from _reasons(value)


def _errors(table: pd.DataFrame, truth: pd.DataFrame, scene: dict[str, Any]) -> tuple[int, int, float, float]:
    """Samples with a position and an empty flag; how many of them are wrong; the share located; the worst error."""
    px = max(camera["field"] for camera in scene["cameras"].values()) / SIZE[0]
    if table["time_s"].max() < truth["time_s"].min():  # no time code: the run counts from cam1's first picture
        truth = truth.assign(time_s=truth["time_s"] - START_S)
    names, trues = table["target"].astype(str).unique(), truth["target"].unique()
    parts = {}
    for name in names:
        rows = table[(table["target"].astype(str) == name)]
        for true in trues:
            own = truth[truth["target"] == true].sort_values("time_s")
            at = np.stack([np.interp(rows["time_s"], own["time_s"], own[a]) for a in "xyz"], -1)
            parts[name, true] = rows, rows[list("xyz")].to_numpy(float) - at
    cost = np.full((len(names), len(trues)), 1e6)
    for (i, name), (j, true) in product(enumerate(names), enumerate(trues)):
        error = parts[name, true][1]
        if np.isfinite(error).any():
            cost[i, j] = np.nanmedian(np.abs(error))
    samples = wrong = 0
    worst = 0.0
    for i, j in zip(*linear_sum_assignment(cost), strict=True):
        rows, error = parts[names[i], trues[j]]
        good = np.isfinite(error).all(1) & (rows["flag"].fillna("") == "").to_numpy()
        sigma = rows[["sigma_x", "sigma_y", "sigma_z"]].to_numpy(float)
        size = np.linalg.norm(error, axis=1)
        bad = good & (np.abs(error) > WRONG_SIGMAS * sigma).any(1) & (size > WRONG_PX * px)
        samples, wrong = samples + int(good.sum()), wrong + int(bad.sum())
        worst = max(worst, float(size[good].max(initial=0.0)))
    return samples, wrong, float(table["x"].notna().mean()) if len(table) else 0.0, worst


def is_right(t: Trial) -> bool:
    """Whether the messages are true: see the head of this file."""
    circumstance = CIRCUMSTANCES[t.kind]
    if t.kind == "none":
        return t.verdict == "good" and t.wrong == 0
    if t.verdict != "good" and t.named:
        return True
    return circumstance.harmless and t.wrong == 0 and (t.verdict != "good" or t.located > 0.6)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--kind", action="append", choices=list(CIRCUMSTANCES))
    parser.add_argument("--keep", help="a folder that keeps the experiments")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    spoiled = [kind for kind in CIRCUMSTANCES if kind != "none"]
    kinds = options.kind or [k for triple in zip(spoiled[::2], spoiled[1::2], strict=False) for k in ("none", *triple)]
    todo = [(kinds[i % len(kinds)], options.seed * 100_000 + i, options.keep) for i in range(options.count)]
    with ProcessPoolExecutor(options.processes) as pool:
        trials, broken = [], []
        asked = {pool.submit(trial, *one): one for one in todo}
        for done in as_completed(asked):
            if (error := done.exception()) is not None:  # of the benchmark itself: an hour of others must not be lost
                broken.append("--kind {} of seed {}".format(*asked[done]) + f": {error!r}")
                continue
            trials.append(t := done.result())
            print(f"{len(trials)}/{len(todo)} {t.kind} {t.seed}: {t.verdict}", file=sys.stderr)
    report(trials)
    if broken:
        sys.exit("\n".join(["could not be tried:", *broken]))


def report(trials: list[Trial]) -> None:
    """A line a circumstance, then the three figures."""
    trials = sorted(trials, key=lambda t: (t.kind, t.seed))
    print(f"{'circumstance':26} n  right good doubtful bad failed refused  wrong/unflagged-in-good worst(in)")
    for kind in CIRCUMSTANCES:
        own = [t for t in trials if t.kind == kind]
        if not own:
            continue
        counts = [sum(t.verdict == word for t in own) for word in ("good", "doubtful", "bad", "failed", "refused")]
        called_good = [t for t in own if t.verdict == "good"]
        wrong, samples = sum(t.wrong for t in called_good), sum(t.samples for t in called_good)
        worst = max((t.worst for t in called_good), default=0.0)
        right = sum(map(is_right, own))
        print(f"{kind:26} {len(own):2} {right:5} {counts[0]:4} {counts[1]:8} {counts[2]:3} {counts[3]:6} {counts[4]:7}"
              f"  {wrong}/{samples} {worst:.3f}")  # fmt: skip
    good = [t for t in trials if t.verdict == "good"]
    wrong, samples = sum(t.wrong for t in good), sum(t.samples for t in good)
    plain = [t for t in trials if t.kind == "none"]
    bent = [t for t in trials if t.kind != "none"]
    print(f"\nwrong, unflagged, in what was called good: {wrong} of {samples}")
    if bent:
        print(f"spoiled, named right: {sum(map(is_right, bent))} of {len(bent)}")
    if plain:
        print(f"unspoiled, called good: {sum(t.verdict == 'good' for t in plain)} of {len(plain)}")
    for t in trials:
        if not is_right(t):
            head = f"--kind {t.kind}, seed {t.seed}: {t.verdict}, located {t.located:.2f}, wrong {t.wrong}"
            print(f"\n{head}: {t.messages[:600]}")


if __name__ == "__main__":
    main()

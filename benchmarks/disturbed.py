"""Films of one or two balls with one disturbance each, tracked as a user does: wrong centroids with an empty flag.

    python benchmarks/disturbed.py --seed 1 --count 8 [--kind x264 stamp ...] [--films]

For each kind, over `count` films of 50 pictures (100 fields): rows, those with an empty flag (plain), of them those
that are wrong (off by more than 5 sd and 0.1 px in X or Y), more than 0.5 px wrong, on no ball (further off than its
radius and 3 px); wrong ones once each film's own mean offset is taken off (a ball lit from one side has its middle of
light elsewhere all the time); pull: rms of error over sd, that offset taken off, the largest hundredth left out; median
sd, px. --films: a line for each film with wrong rows. The number of a film is seed, kind and its place in the count.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from disturbances import KINDS

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.stages.track import track
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.video.reader import open_video


class Outcome(NamedTuple):
    """One film: rows of its table, (rows, 2) errors and sd of those with an empty flag, which rows lie on no ball."""

    number: int
    rows: int
    error: Array
    own: Array  # the same without the film's own offset
    sd: Array
    elsewhere: Array
    message: str
    frames: Array

    @property
    def wrong(self) -> Array:
        return np.asarray(((np.abs(self.error) > 5 * self.sd) & (np.abs(self.error) > 0.1)).any(axis=1))


def outcome(kind: str, seed: int, number: int, folder: Path) -> Outcome:
    """Draw, code, read and track one film."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), number])
    film = KINDS[kind](rng)
    path = film.write(folder / f"{kind}-{seed}-{number}")
    try:
        with open_video(str(path)) as video:
            damage = DamagedPictures(video.info.bits, video.look_again, video.info.codec)
            found = track(damage.over(video.frames(apart=True)), video.info, targets=film.balls, damage=damage)
    except VidtrackError as error:
        none = np.zeros((0, 2))
        return Outcome(number, 0, none, none, none, np.zeros(0, bool), str(error), np.zeros(0))
    finally:
        path.unlink()
    truth = film.place if film.truth is None else film.truth
    table = found.centroids
    later = (table["field"] == ("bottom" if table["field"].iloc[0] == "top" else "top")).to_numpy()
    sample = table["frame"].to_numpy() * (2 if film.interlaced else 1) + later * film.interlaced
    at, sd = table[["Xf", "Yf"]].to_numpy(), table[["sd_x", "sd_y"]].to_numpy()
    names = list(dict.fromkeys(table["target"]))
    own = np.array([names.index(name) for name in table["target"]])
    error = np.full(at.shape, np.nan)
    best = np.inf
    for order in itertools.permutations(range(film.balls)):
        off = at - truth[np.minimum(sample, len(truth) - 1), np.array(order)[own]]
        if (size := np.nanmedian(np.abs(off), axis=0).sum() if np.isfinite(off).any() else np.inf) < best:
            best, error = size, off
    ok = (table["flag"] == "").to_numpy() & np.isfinite(error).all(axis=1)
    elsewhere = np.hypot(*error[ok].T) > film.radius.max() * (1 if film.written is None else 2) + 3
    middle = np.array([np.median(error[ok & (own == k)], axis=0) if (ok & (own == k)).any() else (0, 0)
                       for k in range(len(names))])  # fmt: skip
    return Outcome(
        number, len(table), error[ok], error[ok] - middle[own[ok]], sd[ok], elsewhere, "", table["frame"].to_numpy()[ok]
    )


def print_row(kind: str, outcomes: list[Outcome], seconds: float) -> None:
    """A line of the table."""
    error, own, sd = (np.concatenate([getattr(o, name) for o in outcomes]) for name in ("error", "own", "sd"))
    wrong = np.concatenate([o.wrong for o in outcomes])
    far = wrong & (np.abs(error) > 0.5).any(axis=1)
    else_ = np.concatenate([o.elsewhere for o in outcomes])
    moved = ((np.abs(own) > 5 * sd) & (np.abs(own) > 0.1)).any(axis=1)
    z = np.abs(own / sd).ravel()
    pull = np.sqrt(np.mean(z[z <= np.quantile(z, 0.99)] ** 2)) if z.size else np.nan
    films = sum(o.wrong.any() for o in outcomes)
    print(
        f"{kind:12} {len(outcomes):5} {sum(o.rows for o in outcomes):6} {len(sd):6} {wrong.sum():6} {films:8}"
        f" {far.sum():6} {else_.sum():6} {moved.sum():6} {pull:6.2f} {np.median(sd) if len(sd) else np.nan:7.4f}"
        f" {sum(bool(o.message) for o in outcomes):7} {seconds:6.1f}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=8, help="films of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first film")
    parser.add_argument("--kind", nargs="*", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--films", action="store_true", help="a line for each film with wrong rows")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"{'kind':12} {'films':>5} {'rows':>6} {'plain':>6} {'wrong':>6} {'in films':>8} {'0.5px':>6} {'no ball':>6}"
          f" {'moved':>6} {'pull':>6} {'sd':>7} {'refused':>7} {'s':>6}", flush=True)  # fmt: skip
    every = []
    start_of_all = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        for kind in options.kind:
            start, outcomes = time.process_time(), []
            for number in range(options.first, options.first + options.count):
                outcomes.append(one := outcome(kind, options.seed, number, Path(folder)))
                if options.films and (one.wrong.any() or one.message):
                    where = np.unique(one.frames[one.wrong]).astype(int)
                    most = np.abs(one.error[one.wrong]).max() if one.wrong.any() else 0
                    print(f"    {number}: {one.wrong.sum()} wrong of {len(one.sd)}, up to {most:.2f} px, in pictures "
                          f"{where.tolist()} {one.message}", flush=True)  # fmt: skip
            print_row(kind, outcomes, time.process_time() - start)
            every += outcomes
    print_row("all", every, time.process_time() - start_of_all)


if __name__ == "__main__":
    main()

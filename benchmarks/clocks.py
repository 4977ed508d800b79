"""How well each method estimates a camera's clock: 0.37 frame late, 50 ppm slow, over a minute at 30 frames a second.

    python benchmarks/clocks.py [--trials 20] [--seconds 60]

motion   a driven swing of 10 in, 0.05 px of noise: the epipolar error along the trajectories
sound    a room in which people work, each microphone with as much noise of its own; and a clap in a quiet room
         (both equally far from the source: what travel may do is no part of it)
flash    a lamp that is switched every five seconds, with the shutter open all the time and half of it; one switching

For each: rms error of the offset at the middle of the run and of the rate; the usual standard error; the rms of
the errors over their standard errors, 1 where errors are as large as reported; and processor seconds a trial.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from vidtrack.geometry.camera import project
from vidtrack.location.clocks.motion_clock import estimate_clocks
from vidtrack.simulate.rig import thesis_rig
from vidtrack.timing.agreement import Timing
from vidtrack.timing.clock import Clock
from vidtrack.timing.flash import timing_from_flash
from vidtrack.timing.sound import timing_from_sound

RATE, HZ = 30.0, 8000
LATE = Clock(0.37 / RATE, 50.0)


def by_motion(seconds: float, rng: np.random.Generator) -> Timing:
    def path(t: np.ndarray) -> np.ndarray:
        turns = [10 * np.cos(2 * np.pi * t / 2.5), np.sin(2 * np.pi * t / 1.7), 0.5 * np.cos(2 * np.pi * t)]
        return np.stack(turns, -1)

    t = np.arange(round(seconds * RATE)) / RATE
    rig = thesis_rig(2)
    tracks = [
        project(camera, path(clock.corrected(t)))[None] + rng.normal(0, 0.05, (1, t.size, 2))
        for camera, clock in zip(rig, (Clock(), LATE), strict=True)
    ]
    found = estimate_clocks(rig, [t, t], tracks, free=[1], bias_px=0.05)
    return Timing(found.clocks[1], found.covariance[1])


def by_sound(seconds: float, rng: np.random.Generator, *, clap: bool) -> Timing:
    t = np.arange(-1, seconds + 2, 1 / HZ)
    room = np.convolve(rng.normal(size=t.size), np.hanning(7), "same")
    if clap:
        since = t - rng.uniform(0.3, 0.7) * seconds
        ring = np.where(since > 0, 30 * np.exp(-np.maximum(since, 0) / 0.01), 0)
        room = 0.002 * room + ring * rng.normal(size=t.size)
    own = 0.02 if clap else 1.0
    at = np.arange(int(seconds * HZ)) / HZ
    heard = [
        np.interp(clock.corrected(at), t, room) + 1.9 * own * rng.normal(size=at.size) for clock in (Clock(), LATE)
    ]
    return timing_from_sound(*heard, HZ)


def by_flash(seconds: float, rng: np.random.Generator, *, shutter: float, every_s: float) -> Timing:
    moments = np.arange(every_s / 2, seconds - 1, every_s) + rng.uniform(
        0, 1, int(np.ceil((seconds - 1) / every_s - 0.5))
    )
    t = np.arange(round(seconds * RATE)) / RATE
    levels = []
    for clock in (Clock(), LATE):
        level = 60 + rng.normal(0, 0.03, t.size)
        for k, moment in enumerate(moments):
            level += 50 * (-1) ** k * np.clip((clock.corrected(t) - moment) * RATE / shutter + 0.5, 0, 1)
        levels.append(level)
    return timing_from_flash(t, levels[0], t, levels[1], shutter=None)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=60.0)
    arguments = parser.parse_args()
    ways: dict[str, Callable[[float, np.random.Generator], Timing]] = {
        "motion": by_motion,
        "sound, noise all along": lambda s, rng: by_sound(s, rng, clap=False),
        "sound, one clap": lambda s, rng: by_sound(s, rng, clap=True),
        "flash every 5 s, shutter open": lambda s, rng: by_flash(s, rng, shutter=1.0, every_s=5.0),
        "flash every 5 s, half open": lambda s, rng: by_flash(s, rng, shutter=0.5, every_s=5.0),
        "one flash, shutter open": lambda s, rng: by_flash(s, rng, shutter=1.0, every_s=s),
    }
    print(f"{'':31s}  offset (frame)              rate (ppm)")
    print(f"{'':31s}  rms      sd     ratio       rms      sd     ratio    s/trial")
    for name, way in ways.items():
        found, began = [], time.process_time()
        for seed in range(arguments.trials):
            found.append(way(arguments.seconds, np.random.default_rng(seed)).moved(arguments.seconds / 2))
        each = (time.process_time() - began) / arguments.trials
        known = [timing for timing in found if timing.is_known]
        right = LATE.offset_s + LATE.rate_ppm * 1e-6 * arguments.seconds / 2
        off = np.array([((x.clock.offset_s - right) * RATE, x.clock.rate_ppm - LATE.rate_ppm) for x in known])
        sd = np.array([(x.sd.offset_s * RATE, x.sd.rate_ppm) for x in known])
        rms, ratio = np.sqrt(np.mean(off**2, 0)), np.sqrt(np.mean((off / sd) ** 2, 0))
        usual = np.median(sd, 0)
        row = "     ".join(f"{rms[i]:7.4g} {usual[i]:7.4g} {ratio[i]:6.2f}" for i in (0, 1))
        print(
            f"{name:31s}{row}   {each:6.2f}"
            + (f"   {len(found) - len(known)} unknown" if len(known) < len(found) else "")
        )


if __name__ == "__main__":
    main()

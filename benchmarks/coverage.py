"""Whether intervals hold the truth: small films are tracked, located and analysed.

    PYTHONPATH=. python benchmarks/coverage.py --decays 100 --waves 60 [--seed 2611]

A trial has a rig of its own: two cameras of 320 x 240 px, calibrated from 36 balls that are surveyed to 1/32 in and
seen with 0.05 px. A decay is a ball that is let go; waves are a float of four balls in regular waves beside a gauge.
Counted is how often the truth lies inside the 95 % interval: natural frequency, damping; amplitude ratio and phase of
surge, heave and pitch at the centre of gravity; each sample of these motions inside 1.96 of its sigma.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.simulate.motion import Motion, Oscillation, Turn, attitude, position
from vidtrack.simulate.picture import Picture, empty_scene
from vidtrack.simulate.recording import Actor, Shutter, frames
from vidtrack.simulate.rig import points_on_wires
from vidtrack.simulate.scenario import CameraPlan, camera_from_plan
from vidtrack.stages.analysis import analysis
from vidtrack.stages.bodies import bodies
from vidtrack.stages.calibrate import Calibration, calibrate
from vidtrack.stages.locate import locate
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo

SIZE, SENSOR, RATE = (320, 240), (8.8, 6.6), Fraction(30)
SURVEY, NOISE_PX = 1 / 32, 0.05
FLOAT = {"bow": (8.0, 0.0, 2.0), "stern": (-8.0, 0.0, 2.0), "port": (-2.0, 5.0, 4.0), "starboard": (-2.0, -5.0, 4.0)}
COG = (0.0, 0.0, 1.0)
AXES = {"waves": "+x", "up": "+z"}
GAUGE, GAUGE_SD = 1.25, 0.01
WIDE = 1.96


class Rig(NamedTuple):
    """Cameras as they are, as they are calibrated, and their points."""

    true: dict[str, Camera]
    known: dict[str, tuple[Camera, Any]]
    points: dict[str, pd.DataFrame]


def rig(rng: np.random.Generator) -> Rig:
    """Two cameras from either side, calibrated anew."""
    plans = {
        name: CameraPlan(
            pan_deg=side * rng.uniform(38, 52),
            tilt_deg=rng.uniform(35, 50),
            distance=160,
            size=SIZE,
            sensor=SENSOR,
            f=rng.uniform(10.5, 11.5),
            kappa1=rng.uniform(3e-4, 9e-4),
        )
        for name, side in (("cam1", -1), ("cam2", 1))
    }
    true = {name: camera_from_plan(plan, name) for name, plan in plans.items()}
    place = points_on_wires(rows=3, wires=4, balls=3, spacing=(18.0, 8.0, 10.0))[1]
    surveyed = place + rng.normal(0, SURVEY, place.shape)
    found = {name: _calibrated(camera, place, surveyed, rng, name) for name, camera in true.items()}
    return Rig(
        true,
        {name: (own.camera, own.uncertainty) for name, own in found.items()},
        {name: own.points for name, own in found.items()},
    )


def _calibrated(camera: Camera, place: Array, surveyed: Array, rng: np.random.Generator, name: str) -> Calibration:
    b = project(camera, place) + rng.normal(0, NOISE_PX, (len(place), 2))
    table = pd.DataFrame({"tag": [str(i + 1) for i in range(len(place))]})
    table[["x", "y", "z"]], table[["Xf", "Yf"]] = surveyed, b
    table[["sd_x", "sd_y"]], table["sigma"] = NOISE_PX, SURVEY
    return calibrate(table, image_size=SIZE, sensor=SENSOR, sigma=SURVEY, search=False, camera=name, units="in")


def located(rig: Rig, targets: Mapping[str, Motion], seconds: float, rng: np.random.Generator) -> Any:
    """Film the targets with both cameras, track and locate them."""
    picture, shutter = Picture(), Shutter(open_s=0.001)
    times = np.arange(int(seconds * RATE)) / float(RATE)
    level = picture.background + picture.contrast
    actors = [Actor(lambda t, own=own: position(own, t), 1.3, level) for own in targets.values()]
    seen, lets, kept = {}, {}, {}
    for name, camera in rig.true.items():
        film = frames(
            camera,
            empty_scene(picture, SIZE),
            actors,
            times,
            picture=picture,
            shutter=shutter,
            rate=RATE,
            interlace="none",
            rng=rng,
        )
        begin = np.array([project(camera, actor.path(np.zeros(1)))[0] for actor in actors])
        boxes = pd.DataFrame(begin, columns=["Xf", "Yf"]).assign(width=24.0, height=24.0, target=list(targets))
        own = track(_numbered(film), VideoInfo(*SIZE, RATE), targets=list(targets), start_boxes=boxes)
        seen[name], lets[name], kept[name] = own.centroids, own.tracklets, own.windows
    return locate(seen, rig.known, targets=list(targets), points=rig.points, tracklets=lets, kept=kept)


def _numbered(film: Iterator[Any]) -> Iterator[Frame]:
    for k, levels in enumerate(film):
        yield Frame(k, Fraction(k) / RATE, np.asarray(levels), False, None)


class Held(NamedTuple):
    """A number beside the truth: by how many half widths of its interval it is off."""

    name: str
    off: float


def a_decay(rng: np.random.Generator) -> list[Held]:
    """One decay."""
    fn, zeta, amplitude = rng.uniform(0.7, 1.4), rng.uniform(0.01, 0.08), rng.uniform(8, 18)
    hz, decay = fn * np.sqrt(1 - zeta**2), 2 * np.pi * fn * zeta
    swing = Oscillation(along=(1, 0, 0), amplitude=amplitude, hz=hz, decay=decay, release_s=0.5)
    found = located(rig(rng), {"t1": Motion(oscillations=(swing,))}, 6.0, rng)
    record = analysis(found.trajectories, decay={}, uncertainty=found.record.get("uncertainty"), units="in").record[
        "decay"
    ]
    truth = {"fn_Hz": fn, "zeta": zeta, "Td_s": 1 / hz, "quadratic": 0.0}
    return [_held(name, record[name], value) for name, value in truth.items()]


def in_waves(rng: np.random.Generator) -> list[Held]:
    """One run in regular waves."""
    hz, lag = rng.uniform(0.7, 1.3), dict(zip(("surge", "heave", "pitch"), rng.uniform(-150, 150, 3), strict=True))
    amplitude = {"surge": rng.uniform(0.6, 1.5), "heave": rng.uniform(0.6, 1.8), "pitch": rng.uniform(2, 6)}
    swings = tuple(
        Oscillation(along=along, amplitude=amplitude[dof], hz=hz, phase_deg=-lag[dof])
        for dof, along in (("surge", (1, 0, 0)), ("heave", (0, 0, 1)))
    )
    turns = (Turn(about=(0, 1, 0), amplitude_deg=amplitude["pitch"], hz=hz, phase_deg=-lag["pitch"]),)
    moves = {name: Motion(arm=place, oscillations=swings, turns=turns) for name, place in FLOAT.items()}
    found = located(rig(rng), moves, 7.0, rng)
    poses = bodies(found.trajectories, {"float": FLOAT})
    t = np.arange(0, 7.0, 0.01)
    gauge = pd.DataFrame({"time_s": t, "eta": GAUGE * np.cos(2 * np.pi * hz * t) + rng.normal(0, GAUGE_SD, len(t))})
    done = analysis(
        found.trajectories,
        poses,
        gauge,
        points={"float": {"CoG": COG}},
        axes=AXES,
        waves={"elevation": "eta", "kind": "regular"},
        uncertainty=found.record.get("uncertainty"),
        shapes={"float": FLOAT},
        units="in",
    )
    when = np.linspace(0, 1 / hz, 4000, endpoint=False)
    true = _true((swings, turns), when)
    out = []
    for dof, curve in true.items():
        z = 2 * np.mean(curve * np.exp(-2j * np.pi * hz * when))
        own = done.record["waves"]["responses"][f"float@CoG.{dof}"]
        phase = -np.degrees(np.angle(z))
        out += [_held(f"RAO {dof}", own["rao"], abs(z) / GAUGE), _held(f"phase {dof}", own["phase_deg"], phase, 360)]
    rows = done.motions[done.motions["point"] == "CoG"]
    at = rows["time_s"].to_numpy(float)
    for dof, curve in _true((swings, turns), at - at[0]).items():
        error = rows[dof].to_numpy(float) - (curve - np.nanmean(curve))
        share = np.abs(error) / (WIDE * rows[f"sigma_{dof}"].to_numpy(float))
        out += [Held(f"sample of {dof}", float(v)) for v in share[np.isfinite(share)]]
    return out


def _true(moves: tuple[Sequence[Oscillation], Sequence[Turn]], t: Array) -> dict[str, Array]:
    """Surge, heave (in) and pitch (deg) of the centre of gravity."""
    swings, turns = moves
    p = position(Motion(arm=COG, oscillations=tuple(swings), turns=tuple(turns)), t) - np.array(COG)
    R = np.asarray(attitude(tuple(turns), t))
    return {"surge": p[:, 0], "heave": p[:, 2], "pitch": np.degrees(np.arctan2(R[:, 0, 2], R[:, 2, 2]))}


def _held(name: str, estimate: Mapping[str, Any], truth: float, around: float = 0.0) -> Held:
    if estimate.get("value") is None or not estimate.get("half_width"):
        return Held(name, np.nan)
    off = estimate["value"] - truth
    off = (off + around / 2) % around - around / 2 if around else off
    return Held(name, abs(off) / estimate["half_width"])


def main() -> None:
    """Print a line a quantity: trials, share inside, rms of error over sigma."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--decays", type=int, default=20)
    parser.add_argument("--waves", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    each: dict[str, list[float]] = {}
    for kind, trial, count in (("decay", a_decay, asked.decays), ("waves", in_waves, asked.waves)):
        for k in range(count):
            for held in trial(np.random.default_rng([asked.seed, k, len(kind)])):
                each.setdefault(held.name, []).append(held.off)
            if (k + 1) % 10 == 0 or k + 1 == count:
                print(f"after {k + 1} {kind}:", flush=True)
                for name, offs in each.items():
                    inside = sum(v <= 1 for v in offs)
                    rms = WIDE * np.sqrt(np.nanmean(np.square(offs)))
                    share = 100 * inside / len(offs)
                    print(
                        f"  {name:18} {inside:6d} of {len(offs):6d} ({share:5.1f} %)  {rms:.2f} sigma rms", flush=True
                    )


if __name__ == "__main__":
    main()

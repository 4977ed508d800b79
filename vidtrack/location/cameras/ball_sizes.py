"""How much larger each camera sees the targets of a run than the balls of its calibration, at their distances.

A ball of diameter D at a point p looks D det(J J')^(1/4) wide, J = d(px)/dp (2 x 3): where the lens is as it was
calibrated, the ratio of what a target and the calibration's balls look like is that of their diameters, in every camera
alike. A lens that was zoomed or focused again shows by a ratio of its own, down to a tenth of a percent.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import derivatives


@dataclass(frozen=True)
class Comparing:
    """Which looks are compared.

    balls, looks  at least, of a camera's calibration, and of a target in it; sure: looks from which on their scatter
                  shows their sd, that of fewer is no less than that of the balls
    outlines      sd of a logarithm that is alike in a camera's widths of outlines, where lamps light balls from one
                  side: the rms of 12 cameras of unspoiled random experiments, of whose targets other lamps lit a half,
                  is 0.0042 with chance; some are off by more, up to 0.03, so that cameras must agree (`size_rules`)
    near_px       of a located point that a look is of
    together      looks in a row by whose means it is seen whether the size wanders
    """

    balls: int = 8
    looks: int = 3
    sure: int = 12
    outlines: float = 0.0035
    near_px: float = 3.0
    together: int = 4


COMPARING = Comparing()


def ball_sizes(
    names: Sequence[str],
    cameras: Sequence[Camera],
    looks: Mapping[str, Mapping[str, Mapping[str, ArrayLike]]],
    balls: Mapping[str, Mapping[str, ArrayLike]],
    at: Array,
    points: Array,
    labels: Sequence[str],
    outlined: Collection[str] = (),
) -> dict[str, Any]:
    """By camera: the scatter of its calibration's balls, and of each target how much larger it looks.

    looks   camera: track: time_s (s, on the run's clock), Xf, Yf, width (px)
    balls   camera: the calibration's points, columns x, y, z, Xf, width (px), used; those without width give nothing
    points  (m, M, 3) of the targets `labels` at times at (M,) s
    outlined  cameras whose widths are those of outlines
    Beside the scatter: among, that of the balls themselves, which all cameras see alike; lasting, an sd of `larger`
    that is the same for all targets, where there is one.
    Each target has n, larger (the natural logarithm of the ratio), sd (of that, without the scatter of balls among
    themselves) and wander (sd of means of a few looks in a row, beyond what single ones scatter). Cameras with few
    balls and targets with few looks are left out.
    """
    out: dict[str, Any] = {}
    known = {name: _of_balls(camera, balls.get(name)) for name, camera in zip(names, cameras, strict=True)}
    among = _among([own for own in known.values() if own is not None])
    for name, camera in zip(names, cameras, strict=True):
        own_balls = known[name]
        if own_balls is None or camera.through or at.size < 2:
            continue
        middle, scatter, n = own_balls.middle, own_balls.scatter, len(own_balls.values)
        of_targets: dict[str, list[tuple[float, float]]] = {}
        for own in looks.get(name, {}).values():
            for label, moment, value in _of_looks(camera, own, at, points, labels):
                of_targets.setdefault(label, []).append((moment, value))
        targets = {}
        for label, seen in of_targets.items():
            if len(seen) < COMPARING.looks:
                continue
            values = np.array([value for _, value in sorted(seen)])
            single = max(scatter_of(values), scatter if len(values) < COMPARING.sure else 0.0)
            sd = float(np.hypot(single / np.sqrt(len(values)), scatter / np.sqrt(n))) * 1.2533
            larger = float(np.median(values)) - middle
            targets[label] = {"n": len(values), "larger": larger, "sd": sd, "wander": wander_of(values)}
        if targets:
            out[name] = {"balls": n, "scatter": scatter, "among": scatter if among is None else among}
            out[name] |= {"lasting": COMPARING.outlines} if name in outlined else {}
            out[name]["targets"] = targets
    return out


def timed_looks(looks: Mapping[str, Mapping[str, Any]] | None, t: Array, corrected: Array) -> dict[str, dict[str, Any]]:
    """Looks of a camera's tracks with its corrected times, s; t (T,) its own, corrected (T,) those."""
    if not looks or t.size < 2:
        return {}
    return {
        name: {**own, "time_s": np.interp(np.asarray(own["time_s"], float), t, corrected)}
        for name, own in looks.items()
    }


def px_per_unit(camera: Camera, points: ArrayLike) -> Array:
    """By how many px (n,) a ball of diameter 1 at points (n, 3) looks wide."""
    J = derivatives(camera, np.asarray(points, float), camera.position, ()).by_point
    return np.asarray(np.linalg.det(J @ np.swapaxes(J, -1, -2)) ** 0.25, float)


class _Balls(NamedTuple):
    """Logarithms of what the calibration's balls are wide, world units, by where they are: median, scatter and all."""

    middle: float
    scatter: float
    values: dict[tuple[float, ...], float]


def _of_balls(camera: Camera, table: Mapping[str, ArrayLike] | None) -> _Balls | None:
    if table is None or "width" not in table:
        return None
    width = np.asarray(table["width"], float)
    good = np.isfinite(width) & np.isfinite(np.asarray(table["Xf"], float))
    if "used" in table:
        good &= np.asarray(table["used"], bool)
    if good.sum() < COMPARING.balls:
        return None
    p = np.stack([np.asarray(table[axis], float)[good] for axis in "xyz"], -1)
    values = np.log(width[good] / px_per_unit(camera, p))
    by_place = dict(zip(map(tuple, p.tolist()), values.tolist(), strict=True))
    return _Balls(float(np.median(values)), scatter_of(values), by_place)


def _among(cameras: Sequence[_Balls]) -> float | None:
    """Sd of the sizes of the balls themselves: two cameras see those alike, and err on their own. None of one camera.

    The mean over pairs of cameras of the products of what both see of the same balls; what is beyond three times its
    scatter is a mistake.
    """
    found = []
    for one, other in combinations(cameras, 2):
        both = [
            (a - one.middle, other.values[place] - other.middle)
            for place, a in one.values.items()
            if place in other.values
        ]
        near = [a * b for a, b in both if abs(a) < 3 * one.scatter and abs(b) < 3 * other.scatter]
        if len(near) >= COMPARING.balls:
            found.append(float(np.mean(near)))
    return max(float(np.mean(found)), 0.0) ** 0.5 if found else None


def _of_looks(
    camera: Camera, own: Mapping[str, ArrayLike], at: Array, points: Array, labels: Sequence[str]
) -> list[tuple[str, float, float]]:
    """The target, the moment (s) and the logarithm of the width in world units of each look at a located target."""
    time, width = np.asarray(own["time_s"], float), np.asarray(own["width"], float)
    if not time.size or not len(labels):
        return []
    b = np.stack([np.asarray(own["Xf"], float), np.asarray(own["Yf"], float)], -1)
    moment = np.clip(np.searchsorted(at, time), 1, at.size - 1)
    moment -= time - at[moment - 1] < at[moment] - time
    there = points[:, moment]
    apart = np.linalg.norm(project(camera, there) - b, axis=-1)
    apart = np.where(np.isfinite(apart) & (np.abs(at[moment] - time) < np.diff(at).min()), apart, np.inf)
    whose = apart.argmin(0)
    good = np.flatnonzero(apart.min(0) < COMPARING.near_px)
    if not good.size:
        return []
    values = np.log(width[good] / px_per_unit(camera, there[whose[good], good]))
    return [(labels[k], t, v) for k, t, v in zip(whose[good], time[good].tolist(), values.tolist(), strict=True)]


def scatter_of(values: Array) -> float:
    """Standard deviation by the median of absolute deviations."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def wander_of(values: Array) -> float:
    """Sd of the means of a few looks in a row, beyond what differences of neighbours lead to expect."""
    groups = len(values) // COMPARING.together
    if groups < 4:
        return 0.0
    means = values[: groups * COMPARING.together].reshape(groups, -1).mean(1)
    single2 = float(np.mean(np.diff(values) ** 2)) / 2
    return float(np.sqrt(max(means.var(ddof=1) - single2 / COMPARING.together, 0.0)))

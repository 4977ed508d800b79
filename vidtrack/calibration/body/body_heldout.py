"""Whether cameras refined by a body predict it better in stretches of time that they have not seen.

Each half of the stretches refines cameras that locate the body in the other half: judged are the residuals, px, and
the distances between the targets, both in their standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.calibration.adjustment.measurements import KnownCameras
from vidtrack.calibration.body.body_fit import refitted
from vidtrack.calibration.body.body_sights import Body, BodySights, SurveySights
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import locate_points


class HeldOutSettings(NamedTuple):
    """How refined cameras are judged."""

    stretches: int = 12
    """Of time; every other one refines."""
    sure: float = 2.0
    """Standard errors by which the held-out cost must fall."""


SETTINGS = HeldOutSettings()


class Judged(NamedTuple):
    """What held-out stretches say, before and after: rms px and world units; the cost in squares of sd a stretch."""

    px: tuple[float, float]
    distance: tuple[float, float]
    gain: float  # mean fall of the cost a stretch, of residuals and distances together
    gain_sd: float
    helps: bool

    def as_record(self) -> dict[str, Any]:
        return {
            "residual_px": dict(zip(("before", "after"), self.px, strict=True)),
            "distance": dict(zip(("before", "after"), self.distance, strict=True)),
            "gain": self.gain,
            "gain_sd": self.gain_sd,
            "helps": self.helps,
        }


class _Costs(NamedTuple):
    """Of each moment: squares in sd of residuals and distances; and what the rms are made of."""

    px: Array
    distance: Array
    errors: Array
    offs: Array


def judge_held_out(
    known: KnownCameras, sights: BodySights, body: Body, poses: Array, survey: SurveySights | None = None
) -> Judged:
    """Refine by half of the stretches, locate in the other half, and the other way round."""
    n = sights.b.shape[1]
    stretch: Ints = np.arange(n) * SETTINGS.stretches // n
    before, after, rows = [], [], []
    for half in (0, 1):
        fit, out = (np.flatnonzero(stretch % 2 == k) for k in (half, 1 - half))
        refined = refitted(known, sights.at(fit), body, poses[fit], survey)
        before.append(_costs(known.cameras, sights.at(out), body))
        after.append(_costs(refined, sights.at(out), body))
        rows.append(out)
    where = np.concatenate(rows)
    gains = []
    for part in ("px", "distance"):
        fall = np.concatenate([getattr(b, part) - getattr(a, part) for b, a in zip(before, after, strict=True)])
        gains.append(np.asarray(np.bincount(stretch[where], fall, SETTINGS.stretches), float))
    each: Array = np.asarray(np.sum(gains, 0), float)
    helps = _sure(each) > SETTINGS.sure and min(_sure(own) for own in gains) > -SETTINGS.sure
    return Judged(
        (_rms([c.errors for c in before]), _rms([c.errors for c in after])),
        (_rms([c.offs for c in before]), _rms([c.offs for c in after])),
        float(each.mean()),
        _error(each),
        bool(helps),
    )


def _costs(cameras: Sequence[Camera], sights: BodySights, body: Body) -> _Costs:
    located = locate_points(cameras, sights.b, sd=sights.sd)
    px = np.nansum((located.error / sights.sd) ** 2, (0, 2, 3))
    distance = np.zeros(len(px))
    offs = []
    for i in range(len(body.p)):
        for j in range(i):
            apart = located.point[:, i] - located.point[:, j]
            length = np.linalg.norm(apart, axis=-1)
            along = apart / length[:, None]
            variance = np.einsum("na,nab,nb->n", along, located.covariance[:, i] + located.covariance[:, j], along)
            off = length - np.linalg.norm(body.p[i] - body.p[j])
            distance += np.nan_to_num(off**2 / (variance + 2 * body.sd**2))
            offs.append(off)
    return _Costs(px, distance, located.error, np.concatenate(offs))


def _rms(parts: Sequence[Array]) -> float:
    return float(np.sqrt(np.nanmean(np.concatenate([part.ravel() for part in parts]) ** 2)))


def _error(values: Array) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values)))


def _sure(values: Array) -> float:
    return float(values.mean()) / max(_error(values), 1e-300)

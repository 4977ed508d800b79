"""How the balls of a camera are lit: the way from the middle of their light to the middle of their outline.

A ball's centroid lies towards the lamp. The same balls in the same light are off by the same way in the calibration and
in the run, and little of it is left in space; other light, another size, or a board instead of balls, and all of it is.
Pieces of pictures, a few of each ball, are laid over each other by their centroids; where the light falls off over the
middle of a ball, its outline is fitted (`shaded_ball`), and what was measured is moved to its middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.tracking.outlines.ball_outline import (
    LIT,
    Laid,
    Light,
    Outline,
    Piece,
    by_place,
    laid_over,
    light_of,
    outline_of,
)
from vidtrack.tracking.outlines.light_ways import agreed, suspected, turning
from vidtrack.tracking.outlines.shaded_ball import BALL_FIT, fit_ball


def lighting(
    balls: Sequence[Sequence[Piece]], noise: float, *, lines: int = 1, most: int = LIT.fits
) -> Lighting | None:
    """How balls are lit, by pieces of each of them; None where none is lit from one side.

    noise  grey levels, of a pixel; most: fits of all balls together
    """
    each = int(np.clip(most // max(len(balls), 1), 1, LIT.of_each))
    groups = [[laid_over(some, lines) for some in by_place(pieces, each)] for pieces in balls]
    seen = [[light_of(one, noise / np.sqrt(one.number), lines) for one in own] for own in groups]
    alone = [[one for one in own if one is not None] for own in seen]
    aside = [[one.aside for one in own] for own in alone]
    places = [[one.laid.where for one in own] for own in alone]
    plain = agreed(aside, LIT.least) or turning(aside, places, LIT.least)
    if not plain:
        return _lit_alike(alone, balls, noise, lines) if suspected(aside) else None
    every = max(1, len(alone) // LIT.first)
    first = {i: _outlines(alone[i], noise, lines) for i in range(0, len(alone), every)}
    if every > 1 and not _likely(list(first.values())):
        return None
    fitted = [first[i] if i in first else _outlines(own, noise, lines) for i, own in enumerate(alone)]
    whole = [sum(one.cut for one in own) <= LIT.cut * len(own) for own in fitted]
    alone = [own if good else [] for good, own in zip(whole, alone, strict=True)]
    fitted = [own if good else [] for good, own in zip(whole, fitted, strict=True)]
    heights = np.array([one.height for own in fitted for one in own if np.isfinite(one.height[0])])
    height = None
    if len(heights) >= LIT.heights:
        usual = float(np.median(heights[:, 0]))
        height = usual, float(np.median(np.abs(heights[:, 0] - usual)) * 1.86 / np.sqrt(len(heights)))
        alike = [_of_height(own, usual) for own in fitted]
        if 2 * sum(alike) <= len(alike):
            return None  # pixels have one shape, and balls too: something else is brighter on one side
        fitted = [
            [
                outline_of(one, noise / np.sqrt(one.laid.number), lines, usual, before)
                for one, before in zip(own, found, strict=True)
            ]
            if good
            else []
            for good, own, found in zip(alike, alone, fitted, strict=True)
        ]
    found = Lighting([own if _steady(own) else [] for own in fitted], height)
    return found if found.one_sided else None


def _outlines(own: Sequence[Light], noise: float, lines: int) -> list[Outline]:
    return [outline_of(one, noise / np.sqrt(one.laid.number), lines) for one in own]


def _likely(some: Sequence[Sequence[Outline]]) -> bool:
    """Whether the outlines of some of many balls leave it open that all are lit from one side."""
    ways = [[one.way for one in own if one.held] for own in some]
    places = [[one.where for one in own if one.held] for own in some]
    lost = sum(not one.held for own in some for one in own)
    return lost > sum(map(len, ways)) or suspected(ways) or turning(ways, places, 0.0, LIT.suspected**2)


def _of_height(own: Sequence[Outline], usual: float) -> bool:
    """Whether outlines of a ball are as high as those of all balls are; where none is known, it may be."""
    heights = np.array([one.height for one in own if np.isfinite(one.height[0])]).reshape(-1, 2)
    unlike = np.abs(heights[:, 0] - usual) / np.hypot(heights[:, 1], LIT.height_sd)
    return not unlike.size or bool(np.quantile(unlike, LIT.most) <= LIT.unlike)


def _lit_alike(
    alone: Sequence[Sequence[Light]], balls: Sequence[Sequence[Piece]], noise: float, lines: int
) -> Lighting | None:
    """How balls are lit of which single outlines show too little: all alike, by many of them laid over each other.

    Of a thin rim of light from behind, the middles of low light show half, and fits of single balls a third.
    balls, noise, lines  as those of `lighting`; alone: how balls look at a few places
    """
    pieces = [one for own in balls for one in own]
    shrunk = int(np.median([one.shrunk for one in pieces]))
    pieces = [one for one in pieces if one.shrunk == shrunk]
    if len(pieces) < LIT.stacks * LIT.at_once // 2:
        return None
    ways, wide = [], []
    for k in range(LIT.stacks):
        laid = laid_over(pieces[k :: LIT.stacks], lines)
        own = noise / np.sqrt(laid.number)
        fit = fit_ball(laid.pixels, laid.at, laid.radius, own, lines=lines, full=laid.full)
        if fit is None or fit.misfit > BALL_FIT.well:
            return None
        ways.append(fit.way / laid.radius)
        wide.append(2 * fit.radius / laid.radius)
    way, width = np.mean(ways, axis=0), float(np.mean(wide))
    size, chance = float(np.hypot(*way)), float(np.sqrt(np.var(ways, axis=0).sum() / (LIT.stacks - 1)))
    if not size > max(LIT.least, LIT.beyond * chance):
        return None
    sd = float(np.hypot(chance, LIT.as_sure * size) / np.sqrt(2))

    def outline(laid: Laid) -> Outline:
        radius = laid.radius * laid.shrunk
        return Outline(laid.where, radius, way, sd, True, width * radius, laid.sample)

    return Lighting([[outline(one.laid) for one in own] for own in alone], alike=sd)


def _steady(own: Sequence[Outline]) -> bool:
    """Whether the outlines of a ball agree on how it is lit; two and fewer cannot disagree."""
    held = [one for one in own if one.held]
    if len(held) < max(3, len(own) // 2):
        return len(own) < 3
    way, sd = np.array([one.way for one in held]), float(np.median([one.sd for one in held]))
    usual = np.median(way, axis=0)
    off = np.quantile(np.hypot(*(way - usual).T), LIT.most)
    return bool(off < max(LIT.steady * float(np.hypot(*usual)), 2 * sd))


class Lighting:
    """How balls are lit: `found` has of each of them its outlines at a few places; height: the logarithm of their
    height over their width, and its sd; alike: sd in radii of what is off alike in all of them.
    """

    def __init__(
        self, found: Sequence[Sequence[Outline]], height: tuple[float, float] | None = None, alike: float = 0.0
    ) -> None:
        self.height, self._alike = height, alike
        self.found = [list(own) for own in found]
        held = [one for own in self.found for one in own if one.held]
        ways = [[one.way for one in own if one.held] for own in self.found]
        near = min((one.radius for one in held), default=1.0)
        lost = sum(not one.held for own in self.found for one in own)
        places = [[one.where for one in own if one.held] for own in self.found]
        least = LIT.least_way / near
        self.one_sided = agreed(ways, least) or turning(ways, places, least) or lost > len(held)
        self._all = _Field(held)
        self._own = [_Field([one for one in own if one.held]) for own in self.found]

    def ways(self, i: int, where: Array, radius: Array) -> tuple[Array, Array]:
        """The ways (2, k) px from centroids of ball i at (2, k) px, of radius (k,) px, to the middle of its outline,
        and their sd (k,) px. i: -1 for what is none of those balls.

        Its own outlines and those of all balls are weighed by what is known of either.
        """
        own = self._own[i] if i >= 0 else None
        lost = [one.sd for one in (self.found[i] if i >= 0 else ()) if not one.held]
        way, sd = np.zeros_like(where), np.zeros(where.shape[1])
        if self._all.count:
            way, unsure = self._all.at(where)
            sd = np.hypot(unsure, np.hypot(self._all.sd, self._all.scatter))
        if own is not None and own.count and own.count >= len(lost):
            (here, unsure), apart = own.at(where), self._all.scatter
            sd_own = np.hypot(unsure, np.hypot(own.sd, own.scatter))
            share = apart**2 / (apart**2 + sd_own**2)
            off = np.hypot(*(here - way))
            most = min(LIT.outlying * float(np.hypot(apart, np.hypot(own.sd, own.scatter))), LIT.other * apart)
            if (known := off[np.isfinite(off)]).size and np.median(known) > most:
                share = np.ones_like(share)
            way = share * here + (1 - share) * way
            sd = np.sqrt(share) * sd_own
        if lost:
            sd = np.hypot(sd, max(lost))
        return way * radius, np.nan_to_num(np.hypot(sd, self._alike) * radius)

    def ways_of_all(self, position: Array, pixels: Array, measured: Array, lines: int) -> tuple[Array, Array]:
        """The ways (2, k, n) px of those n balls at positions (2, k, n) px, and their sd (k, n) px.

        pixels    (k, n) above the threshold. A ball that shows far more or fewer than usual was measured at another
                  threshold, with more or less of its dark side, or is nearer or farther
        measured  (k, n) px, sd of the centroid as it was measured: where it is far larger than usual, another part of
                  the light was
        """
        way, sd = np.zeros(position.shape), np.zeros(pixels.shape)
        for i in range(pixels.shape[1]):
            radius = _smooth(np.sqrt(lines * pixels[:, i] / np.pi))
            way[:, :, i], known = self.ways(i if i < len(self.found) else -1, position[:, :, i], radius)
            unlike = np.maximum(np.abs(_over(pixels[:, i])) - LIT.other_pixels, 0.0)
            unlike += np.maximum(_over(measured[:, i]) - LIT.other_sd, 0.0)
            unlike *= np.nan_to_num(np.hypot(*way[:, :, i]))
            sd[:, i] = np.hypot(known, LIT.per_other * unlike)
        return way, sd

    def widths(self, i: int) -> tuple[Array, list[int]]:
        """Xf, Yf and width (m, 3) px of the outlines of ball i, and their samples, in order of time."""
        known = sorted((one for one in self.found[i] if np.isfinite(one.width)), key=lambda one: one.sample)
        return np.array([[*one.where, one.width] for one in known]).reshape(-1, 3), [one.sample for one in known]

    def as_record(self) -> dict[str, Any]:
        """For the diagnostics: px; height: over the width, height_sd: of its logarithm."""
        held = [one for own in self.found for one in own if one.held]
        ways = [float(np.hypot(*one.way)) * one.radius for one in held]
        lost = sum(not one.held for own in self.found for one in own)
        high = {} if self.height is None else {"height": float(np.exp(self.height[0])), "height_sd": self.height[1]}
        sds = [one.sd * one.radius for one in held]
        lasting = self._alike * float(np.median([one.radius for one in held])) if held else 0.0
        return high | {
            "outlines": len(held),
            "without": lost,
            "way_px": float(np.median(ways)) if ways else np.nan,
            "largest_way_px": max(ways, default=np.nan),
            "sd_px": float(np.median(sds)) if held else np.nan,
            "lasting_px": lasting or (float(np.median(sds)) / len(sds) ** 0.5 if held else 0.0),
        }


def _smooth(radius: Array) -> Array:
    """Means over a few samples about each, of those that are known; whole pixels make single ones uneven."""
    known = np.isfinite(radius)
    ones = np.ones(min(LIT.about, radius.size))
    if not ones.size:
        return radius
    count = np.convolve(known, ones, mode="same")
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.convolve(np.where(known, radius, 0.0), ones, mode="same") / count
    return np.where(known, mean, np.nan)


def _over(values: Array) -> Array:
    """By how much logarithms of values (k,) above 0 lie over their median; 0 of others."""
    known = values > 0
    size = np.log(values[known])
    over = np.zeros(values.shape)
    over[known] = size - np.median(size) if size.size else 0.0
    return over


class _Field:
    """Ways in radii, which change a little with the place.

    sd  of a single way, as its fit has it; scatter: of ways about the field
    """

    def __init__(self, held: Sequence[Outline]) -> None:
        self.count, self.sd, self.scatter = len(held), 0.0, 0.0
        if not held:
            return
        where, way = np.array([one.where for one in held]), np.array([one.way for one in held])
        sd = np.array([one.sd for one in held])
        self.sd = float(np.median(sd))
        self._middle, self._reach = where.mean(axis=0), max(float(np.ptp(where, axis=0).max()) / 2, 1.0)
        terms = self._terms(where.T)
        spare, outlying = max(1.0, self.count - len(terms)) / self.count, np.ones(self.count)
        for _ in range(LIT.rounds):
            weight = 1 / (sd**2 + self.sd**2 + self.scatter**2) / outlying
            usual = float(np.hypot(*(weight @ way / weight.sum())))
            normal = (terms * weight) @ terms.T
            normal[[1, 2], [1, 2]] += 1 / max(LIT.changes * usual, 1e-6) ** 2
            self._covariance = np.linalg.inv(normal)
            self._shape = self._covariance @ (terms * weight) @ way
            left = np.hypot(*(way - terms.T @ self._shape).T)
            outlying = np.maximum(1, left / max(LIT.outlying * float(np.median(left)), 1e-9)) ** 2
            self.scatter = float(np.median(left) / np.sqrt(np.log(4) * spare))

    def _terms(self, where: Array) -> Array:
        off = (where - self._middle[:, None]) / self._reach
        return np.stack([np.ones(off.shape[1]), *np.clip(off, -2.0, 2.0)])

    def at(self, where: Array) -> tuple[Array, Array]:
        """Ways (2, k) at places (2, k), and what the field is unsure by there (k,)."""
        terms = self._terms(where)
        return np.asarray((terms.T @ self._shape).T), np.sqrt(np.einsum("ik,ij,jk->k", terms, self._covariance, terms))


def light_record(
    lit: Lighting | None, balls: Sequence[Sequence[Piece]], noise: float, *, lines: int = 1
) -> dict[str, Any]:
    """For the diagnostics: lighting, or where no ball is lit from one side light_aside_px: by how much the middles of
    their light may lie aside all the same, where a lamp lights them for other cameras; nothing where no ball is seen.

    balls, noise, lines  as those of `lighting`
    """
    if lit is not None:
        return {"lighting": lit.as_record()}
    laid = [laid_over(some, lines) for pieces in balls for some in by_place(pieces, LIT.of_each)]
    seen = [one for own in laid if (one := light_of(own, noise / np.sqrt(own.number), lines)) is not None]
    if len(seen) < LIT.agreed[0]:
        return {}
    aside = np.array([one.aside * one.laid.radius * one.laid.shrunk for one in seen])
    chance = np.sqrt(aside.var(axis=0).sum() / (len(aside) - 1))
    return {"light_aside_px": LIT.unseen * float(np.hypot(np.hypot(*aside.mean(axis=0)), chance))}


def lit_findings(lit: Lighting | None) -> list[Finding]:
    """Whether balls are lit from one side, and what was done."""
    if lit is None:
        return []
    own = lit.as_record()
    text = (
        f"balls are lit from one side: the middle of their light lies {own['way_px']:.2f} px from that of their "
        f"outline, at most {own['largest_way_px']:.2f} px. Positions are those of the outline, within "
        f"{own['sd_px']:.2f} px, which their sd holds."
        if own["outlines"]
        else "balls are lit from one side, and no outline can be fitted: their sd holds how far their light may be off."
    )
    if own["outlines"] and own["without"]:
        text += f" {own['without']} of {own['without'] + own['outlines']} outlines could not be fitted."
    return [Finding("note", "lit-from-one-side", text, "Light from beside the camera, or from all sides, is better.")]

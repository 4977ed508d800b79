"""Whether the ways from the middles of balls' light to those of their outlines are chance, or what a lamp makes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vidtrack.arrays import Array
from vidtrack.tracking.outlines.ball_outline import LIT


def agreed(balls: Sequence[Sequence[Array]], least: float) -> bool:
    """Whether ways (2,), in radii, of all balls together, or of one that was seen often enough, are no chance: what
    the grid of pixels and noise make of them goes all ways, a lamp's is alike.
    """
    enough, beyond = LIT.agreed
    every = [way for ball in balls for way in ball]
    for own in [*(ball for ball in balls if len(ball) >= enough), *([every] if every else [])]:
        way = np.array(own)
        chance = np.sqrt(way.var(axis=0).sum() / max(len(way) - 1, 1))
        if np.hypot(*way.mean(axis=0)) > max(least if len(way) >= enough else LIT.alone, beyond * chance):
            return True
    return False


def turning(
    balls: Sequence[Sequence[Array]], places: Sequence[Sequence[Array]], least: float, beyond: float = LIT.turning[1]
) -> bool:
    """Whether ways (2,), in radii, of many balls change evenly with their places (2,) px by more than chance: a lamp
    beside the camera lights each on the side that is turned to it, all ways, and on the whole none.

    The squares that two slopes explain, over those of what they leave and its freedom, follow F; beyond: of that.
    """
    fewest = LIT.turning[0]
    way, place = (np.array([one for own in of for one in own]) for of in (balls, places))
    if len(way) < fewest:
        return False
    off = place - place.mean(axis=0)
    terms = np.column_stack([np.ones(len(way)), off / max(float(np.abs(off).max()), 1.0)])
    shape = np.linalg.lstsq(terms, way, rcond=None)[0]
    turned = terms[:, 1:] @ shape[1:]
    chance = float(np.square(way - terms @ shape).sum()) / (len(way) - 3)
    return bool(np.square(turned).sum() > max(2 * beyond * chance, len(way) * least**2))


def suspected(balls: Sequence[Sequence[Array]]) -> bool:
    """Whether ways (2,) of all balls together may be more than chance: it takes a few fits to know."""
    way = np.array([one for own in balls for one in own]).reshape(-1, 2)
    if len(way) < LIT.agreed[0]:
        return False
    chance = np.sqrt(way.var(axis=0).sum() / (len(way) - 1))
    return bool(np.hypot(*way.mean(axis=0)) > LIT.suspected * chance)

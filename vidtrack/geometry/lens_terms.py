"""The terms of the lens model, in one table that every equation, Jacobian and message reads.

A term adds its coefficient times a fixed function of the distorted position to the undistorted one:

    (Xu, Yu) = (Xd, Yd) + sum over terms of coefficient * shift(Xd, Yd)

so that a new term is a row here, a field of `geometry.camera.Camera` and, where it forms a new lens model, a row of
`LENS_MODELS`. Sources: kappa Tsai (1987); p Brown (1966); s, a thin prism, Weng, Cohen and Herniou (1992);
q completes p and s to all terms of second order, as an oblique pane of glass or a tilted sensor has them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array


class LensTerm(NamedTuple):
    """One term.

    power  of its unit: 1 / unit(dx)^power
    shift  (Xu - Xd, Yu - Yd) a unit of the coefficient, from Xd, Yd and r^2
    slope  derivatives of the shift: dXu/dXd, dXu/dYd, dYu/dXd, dYu/dYd
    """

    power: int
    shift: Callable[[Array, Array, Array], tuple[Array, Array]]
    slope: Callable[[Array, Array, Array], tuple[Array, Array, Array, Array]]


def _radial(n: int) -> LensTerm:
    """kappa_n: (Xd, Yd) r^2n."""

    def slope(x: Array, y: Array, r2: Array) -> tuple[Array, Array, Array, Array]:
        gain, steep = r2**n, 2 * n * r2 ** (n - 1)
        cross = steep * x * y
        return gain + steep * x * x, cross, cross, gain + steep * y * y

    return LensTerm(2 * n, lambda x, y, r2: (x * r2**n, y * r2**n), slope)


def _zero(x: Array) -> Array:
    return np.zeros(np.shape(x))


TERMS = {
    "kappa1": _radial(1),
    "kappa2": _radial(2),
    "p1": LensTerm(1, lambda x, y, r2: (r2 + 2 * x * x, 2 * x * y), lambda x, y, r2: (6 * x, 2 * y, 2 * y, 2 * x)),
    "p2": LensTerm(1, lambda x, y, r2: (2 * x * y, r2 + 2 * y * y), lambda x, y, r2: (2 * y, 2 * x, 2 * x, 6 * y)),
    "kappa3": _radial(3),
    "s1": LensTerm(1, lambda x, y, r2: (r2, _zero(r2)), lambda x, y, r2: (2 * x, 2 * y, _zero(x), _zero(x))),
    "s2": LensTerm(1, lambda x, y, r2: (_zero(r2), r2), lambda x, y, r2: (_zero(x), _zero(x), 2 * x, 2 * y)),
    "q1": LensTerm(1, lambda x, y, r2: (y * y, _zero(r2)), lambda x, y, r2: (_zero(x), 2 * y, _zero(x), _zero(x))),
    "q2": LensTerm(1, lambda x, y, r2: (_zero(r2), x * x), lambda x, y, r2: (_zero(x), _zero(x), 2 * x, _zero(x))),
}
"""Every term but skew, which acts in the frame buffer (`camera.frame_buffer_from_distorted`)."""

RADIAL = ("kappa1", "kappa2", "kappa3")
"""The terms of r^2, r^4 and r^6: they alone can fold the model."""

LENS_MODELS = {
    "tsai": ("kappa1",),
    "equidistant": ("kappa1",),
    "tsai2": ("kappa1", "kappa2"),
    "tsai3": ("kappa1", "kappa2", "kappa3"),
    "fisheye": ("kappa1", "kappa2", "kappa3"),
    "brown": ("kappa1", "kappa2", "p1", "p2"),
    "affine": ("kappa1", "kappa2", "p1", "p2", "skew"),
    "prism": ("kappa1", "kappa2", "kappa3", "p1", "p2", "s1", "s2", "skew"),
    "quadratic": ("kappa1", "kappa2", "kappa3", "p1", "p2", "s1", "s2", "q1", "q2", "skew"),
}
"""The lens models, from plain to rich, and the terms that each one frees."""

EQUIDISTANT = ("equidistant", "fisheye")
"""The lens models whose terms act on an equidistant projection (`geometry.projection`); the others are perspective."""

RICHEST = "quadratic"

COEFFICIENTS = ("kappa1", "kappa2", "p1", "p2", "skew", "kappa3", "s1", "s2", "q1", "q2")
"""All coefficients, in the order in which parameters are kept; new ones come last."""


def unit_power(name: str) -> int:
    """The power of 1/unit(dx) in which a coefficient is given; 0 for skew."""
    return TERMS[name].power if name in TERMS else 0

"""The weights of a template: of the pixels of a window, for each quantity that is linear in them.

Windows of one size are one matrix; see `template` for what is measured with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints

Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class Mask:
    """The mask of a template, and where it is valid.

    spare_px          of the soft edge, as segmentation grows it, that hold no light but only noise
    recentred         times that a window is moved onto its target, before the target counts as not there
    ring_px           about the mask, for the background
    near_centre_px    from the centre of its window's middle pixel up to which a target is well inside its mask
    off_centre_px     a target further from the centre of its window's middle pixel is not where the mask is
    uneven_ring       sigmas by which four harmonics of a ring may differ from a plane by chance: at 5.5, two windows in
                      a thousand of compressed video did. A false neighbour costs a segmentation, but no accuracy
    stray             pixels that one outside of the mask counts as: more than any target has
    most_cut          share of its light that the mask's outline may cut: more is something else
    plain             sd of its noise beyond which the light beyond the outline is plainly there
    steepest          ratio of the light on both sides of the outline, a px apart, at least
    pixels_as_floats  made floats at once, about: more no longer fit the processor's caches
    """

    spare_px: float = 0.25
    recentred: int = 2
    ring_px: int = 3
    near_centre_px: float = 0.6
    off_centre_px: float = 0.9
    uneven_ring: float = 8.0
    stray: float = 2.0**20
    most_cut: float = 0.5
    plain: float = 3.0
    steepest: float = 1e-4
    pixels_as_floats: int = 100_000


MASK = Mask()


class Weights(NamedTuple):
    """Windows (m, height * width) times `linear` (.., 13) are mass, m_x, m_y, the background; how the ring differs from
    a plane: its second and third harmonic about the target, each with a noise of 1 for a noise of 1; the second
    moments of the light; and what the mask's outline cuts. `moments` (.., 3) are its first columns.

    pull           px by which one grey level of those may have moved the target, times its mass
    inside            weights of what is counted: 1 within the mask, MASK.stray without
    x_noise, y_noise  sd of m_x, m_y for a noise of 1; cut_noise: of what the outline cuts, outside of it
    ring              columns of the background's pixels; across (2, ring): their x and y, each of length 1
    """

    width: int
    height: int
    linear: Array
    moments: Array
    pull: float
    inside: Float32
    x_noise: float
    y_noise: float
    cut_noise: float
    ring: Ints
    across: Array


@lru_cache(maxsize=256)
def weights(twice_a: int, twice_b: int) -> Weights:
    """Weights of an elliptical mask of half axes twice_a / 2 and twice_b / 2 px."""
    a, b = twice_a / 2, twice_b / 2
    half_w, half_h = int(np.ceil(a)) + MASK.ring_px, int(np.ceil(b)) + MASK.ring_px
    y, x = np.mgrid[-half_h : half_h + 1, -half_w : half_w + 1].reshape(2, -1).astype(float)
    disc = ((x / a) ** 2 + (y / b) ** 2 <= 1).astype(float)
    ring = ((x / (a + 1)) ** 2 + (y / (b + 1)) ** 2 > 1).astype(float)
    plane = np.linalg.pinv((np.stack([np.ones_like(x), x, y]) * ring).T)  # (3, pixels)
    mass = disc - disc.sum() * plane[0]
    m_x = disc * x - (disc * x * x).sum() * plane[1]
    m_y = disc * y - (disc * y * y).sum() * plane[2]
    uneven = _harmonics(x / a, y / b, ring, plane, np.stack([np.ones_like(x), x, y]))
    second = [disc * along - (disc * along).sum() * plane[0] for along in (x * x, y * y, x * y)]
    shape = 2 * half_h + 1, 2 * half_w + 1
    cut = _outline(disc.reshape(shape), x.reshape(shape), y.reshape(shape)).reshape(2, -1)
    cut -= cut.sum(axis=1, keepdims=True) * plane[0]
    linear = np.stack([mass, m_x, m_y, plane[0], *uneven, *second, *cut], axis=1)
    pull = float(np.hypot(m_x, m_y)[ring > 0].sum() / np.sqrt((uneven**2).sum(axis=0))[ring > 0].sum())
    inside = (disc + MASK.stray * (1 - disc)).astype(np.float32)
    x_noise, y_noise, cut_noise = (float(np.sqrt(np.square(of).sum())) for of in (m_x, m_y, cut[1]))
    columns = np.flatnonzero(ring)
    across = np.stack([x[columns] / np.sqrt((ring * x * x).sum()), y[columns] / np.sqrt((ring * y * y).sum())])
    size, first = (2 * half_w + 1, 2 * half_h + 1), np.ascontiguousarray(linear[:, :3])
    return Weights(*size, linear, first, pull, inside, x_noise, y_noise, cut_noise, columns, across)


def _outline(disc: Array, x: Array, y: Array) -> Array:
    """Weights (2, rows, columns) of the integral of x I n_x over a mask's outline, which for one that is alike in x and
    y is that of y I n_y: the mean of both; by the pixels inside of the outline, and by those outside.
    """
    out = np.zeros((2, *disc.shape))
    for axis, along in ((1, x), (0, y)):
        left, right = (slice(None),) * axis + (slice(None, -1),), (slice(None),) * axis + (slice(1, None),)
        side = (disc[left] - disc[right]) * (along[left] + along[right]) / 4
        for i, inner in enumerate((disc[left] > disc[right], disc[left] < disc[right])):
            out[i][left] += side * inner
            out[i][right] += side * ~inner
    return out


def cut_light(inside: Array, outside: Array, off: Array, noise: Array | float = 0.0) -> Array:
    """Light by which m_x grows less as a target moves, that at the outline falling off exponentially across it.

    inside, outside  the integral over the outline half a px inside and outside of it; off (2, ..) px, of the target
    noise            of `outside`: as far as it may be noise alone, it cuts nothing
    With the rate q, the mean over the outline grows as I_0(q off), while what it cuts on the way there is (second
    order) a half of that.
    """
    inside, outside = np.maximum(inside, 1e-9), np.maximum(outside, 1e-9)
    outside = outside**3 / (outside**2 + np.square(MASK.plain * noise))
    outside = np.clip(outside, MASK.steepest * inside, inside)
    grown = np.square(np.log(inside / outside)) * np.square(off).sum(axis=0)
    return np.asarray(np.sqrt(inside * outside) * (1 + grown / 8) / (1 + grown / 4))


def _harmonics(x: Array, y: Array, ring: Array, plane: Array, powers: Array) -> Array:
    """Weights (4, pixels) of length 1 for cos 2t, sin 2t, cos 3t and sin 3t over the ring, blind to any plane.

    x, y (pixels,) in half axes; ring: 1 on it; plane and powers (3, pixels) such that plane @ I are the coefficients
    of the powers. The outer pixels weigh more: a neighbour comes in from there
    """
    around = ((x + 1j * y) / np.hypot(x, y).clip(1e-9)) ** np.array([[2], [3]]) * ring * (np.hypot(x, y) - 1)
    bare = np.concatenate([around.real, around.imag])
    blind = bare - (bare @ powers.T) @ plane
    return np.asarray(blind / np.linalg.norm(blind, axis=1, keepdims=True))

"""The normal equations of few parameters that all measurements share and of many small blocks that none share.

A block is a point (3 unknowns), a wand at one moment (3 each ball), a pose (6). Blocks meet each other only through
the shared parameters:

    [ U   E^T ] [ step of the shared ]   [ g ]
    [ E   V   ] [ step of the blocks ] = [ h ]       V is block diagonal

so each block is solved in terms of the shared parameters (Schur's complement; Brown 1958): U - E^T V^-1 E is as
small as the shared parameters are few, however many the blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Bools

MOST_CONDITION = 1e14
"""Condition of the scaled equations beyond which a parameter is left open."""

AT_ONCE = 2_000_000
"""Numbers, about, of the blocks whose derivatives are worked on together."""

_OPEN = "the measurements leave some parameter open; fix it or give it a prior"


class Equations(NamedTuple):
    """Measurements of one kind, linearised; row a belongs to block a of its family.

    residual   (n, q)  measured minus computed; anything where the weight is zero
    weight     (n, q)  one over the variance; zero where a measurement is missing
    columns    (k,)  which of the K shared parameters the measurements depend on
    by_shared  (n, q, k)  derivatives of what is computed by these
    family     which family of blocks; None: the measurements depend on no block
    by_block   (n, q, d)  derivatives by the block; None without a family
    """

    residual: Array
    weight: Array
    columns: NDArray[np.intp]
    by_shared: Array
    family: int | None = None
    by_block: Array | None = None


class Prior(NamedTuple):
    """What is known of each coordinate of the n blocks of a family beforehand.

    information  (n, d)  one over the variance; 0: nothing is known, inf: the coordinate is held
    shift        (n, d)  what is known minus the present value
    """

    information: Array
    shift: Array


class BlockEquations(NamedTuple):
    """The part of the normal equations that belongs to one family: n blocks of d unknowns."""

    E: Array  # (n, d, K)
    V: Array  # (n, d, d)
    h: Array  # (n, d)
    held: Bools  # (n, d)


class Normal(NamedTuple):
    """The normal equations of K shared parameters and of families of blocks."""

    U: Array  # (K, K)
    g: Array  # (K,)
    families: tuple[BlockEquations, ...]


class Covariance(NamedTuple):
    """What the equations leave uncertain, in the units of the weights."""

    shared: Array  # (K, K)
    blocks: tuple[Array, ...]  # for each family (n, d, d)
    fitted: tuple[Array, ...]  # for each of the measurements (n, q), the variance of what is computed


def summed(equations: Sequence[Equations], K: int, priors: Sequence[Prior]) -> Normal:
    """The normal equations of all measurements and of what is known of each family of blocks beforehand."""
    U, g = np.zeros((K, K)), np.zeros(K)
    sizes = [prior.information.shape for prior in priors]
    E = [np.zeros((n, d, K)) for n, d in sizes]
    V = [np.zeros((n, d, d)) for n, d in sizes]
    h = [np.zeros((n, d)) for n, d in sizes]
    for each in equations:
        root = np.sqrt(each.weight)
        lost = each.weight == 0
        r = np.where(lost, 0.0, each.residual) * root
        A = np.where(lost[..., None], 0.0, each.by_shared) * root[..., None]
        flat = A.reshape(lost.size, len(each.columns))
        U[np.ix_(each.columns, each.columns)] += flat.T @ flat
        g[each.columns] += flat.T @ r.reshape(-1)
        if each.family is not None and each.by_block is not None:
            B = np.where(lost[..., None], 0.0, each.by_block) * root[..., None]
            turned = B.swapaxes(-1, -2)
            E[each.family][..., _place(each.columns)] += turned @ A
            V[each.family] += turned @ B
            h[each.family] += (turned @ r[..., None])[..., 0]
    families = [_with_prior(*parts) for parts in zip(E, V, h, priors, strict=True)]
    return Normal(U, g, tuple(families))


def _with_prior(E: Array, V: Array, h: Array, prior: Prior) -> BlockEquations:
    held = np.asarray(~np.isfinite(prior.information))
    known = np.where(held, 0.0, prior.information)
    h += known * np.where(held, 0.0, prior.shift)
    E[held], h[held] = 0, 0
    V[held[:, :, None] | held[:, None, :]] = 0
    d = V.shape[-1]
    V[:, range(d), range(d)] += np.where(held, 1.0, known)
    return BlockEquations(E, V, h, held)


def solved(normal: Normal, damping: float = 0.0) -> tuple[Array, tuple[Array, ...]]:
    """The step of the shared parameters (K,) and of the blocks (n, d); damped as Levenberg and Marquardt do."""
    S = normal.U + damping * np.diag(np.diag(normal.U))
    g = normal.g.copy()
    kept = []
    for family in normal.families:
        inverse = np.linalg.inv(family.V * (1 + damping * np.eye(family.V.shape[-1])))
        Y = inverse @ family.E
        y = (inverse @ family.h[..., None])[..., 0]
        S = S - _flat(family.E).T @ _flat(Y)
        g = g - _flat(Y).T @ family.h.ravel()
        kept.append((y, Y))
    scale = _scale(S)
    shared = scale * np.linalg.lstsq(S * np.outer(scale, scale), scale * g)[0]
    return shared, tuple(y - Y @ shared for y, Y in kept)


def covariance(normal: Normal, equations: Sequence[Equations], priors: Sequence[Prior] | None = None) -> Covariance:
    """The covariance of the shared parameters, of every block, and the variance of everything computed.

    priors  those of `summed`: with them the shared parameters' own is found without their sums of squares, in which
            what blocks take up rounds away half of the digits that are left (1e-8 of a covariance, for a bundle)
    Raises ValueError where the measurements leave some parameter open.
    """
    S, kept = normal.U, []
    for family in normal.families:
        inverse = np.asarray(np.linalg.inv(family.V))
        d = inverse.shape[-1]
        inverse[:, range(d), range(d)] -= family.held
        Y = np.asarray(inverse @ family.E)
        S = S - _flat(family.E).T @ _flat(Y)
        kept.append((inverse, Y))
    if priors is None:
        scale = _scale(S)
        scaled = S * np.outer(scale, scale)
        if S.size and not np.linalg.cond(scaled) <= MOST_CONDITION:
            raise ValueError(_OPEN)
        shared = np.linalg.inv(scaled) * np.outer(scale, scale)
    else:
        R = reduced(equations, len(S), priors)
        size = np.linalg.norm(R, axis=0)
        size[size == 0] = 1.0
        if S.size and not np.linalg.cond(R / size) <= np.sqrt(MOST_CONDITION):
            raise ValueError(_OPEN)
        root = np.linalg.inv(R / size) / size[:, None]
        shared = root @ root.T
    blocks = tuple(inverse + Y @ shared @ Y.swapaxes(-1, -2) for inverse, Y in kept)
    fitted = tuple(_variance_of_fitted(each, shared, kept) for each in equations)
    return Covariance(shared, blocks, fitted)


def reduced(equations: Sequence[Equations], K: int, priors: Sequence[Prior]) -> Array:
    """R (K, K) with R^T R = U - E^T V^-1 E: what is measured of the shared parameters alone, the blocks projected out.

    By orthogonal transformations of the derivatives themselves (Golub and Plemmons 1980).
    """
    left = [np.zeros((K, K))]
    for each in equations:
        if each.family is None or each.by_block is None:
            alone = np.zeros((each.weight.size, K))
            rows = _rooted(each.by_shared, np.sqrt(each.weight))
            alone[:, each.columns] = rows.reshape(len(alone), len(each.columns))
            left.append(alone)
    for family, prior in enumerate(priors):
        own = [each for each in equations if each.family == family and each.by_block is not None]
        rows = sum(each.weight.shape[1] for each in own) + prior.information.shape[1]
        several = max(1, AT_ONCE // max(rows * K, 1))
        for first in range(0, len(prior.information), several):
            some = slice(first, first + several)
            A, B = _of_blocks(own, prior.information, some, K)
            across = np.linalg.qr(B)[0]
            A -= across @ (across.swapaxes(-1, -2) @ A)
            left.append(np.asarray(np.linalg.qr(_flat(A), mode="r")))
    return np.asarray(np.linalg.qr(np.concatenate(left), mode="r"))


def _of_blocks(equations: Sequence[Equations], information: Array, some: slice, K: int) -> tuple[Array, Array]:
    """Rows of some blocks, weighted, those of what is known beforehand last: by the shared ones and by each block."""
    parts = [np.sqrt(each.weight[some]) for each in equations]
    known, d = information[some], information.shape[1]
    rows = sum(root.shape[1] for root in parts)
    A, B = np.zeros((len(known), rows + d, K)), np.zeros((len(known), rows + d, d))
    at = 0
    for each, root in zip(equations, parts, strict=True):
        own = slice(at, at + root.shape[1])
        A[:, own, _place(each.columns)] = _rooted(each.by_shared[some], root)
        B[:, own] = _rooted(np.asarray(each.by_block)[some], root)
        at = own.stop
    held = ~np.isfinite(known)
    B = np.where(held[:, None, :], 0.0, B)
    B[:, range(-d, 0), range(d)] = np.sqrt(np.where(held, 1.0, known))
    return A, B


def _rooted(by: Array, root: Array) -> Array:
    """Derivatives (n, q, ...) over the standard deviations of what is measured; 0 where it is missing."""
    return np.asarray(np.where((root == 0)[..., None], 0.0, by) * root[..., None])


def _variance_of_fitted(each: Equations, shared: Array, kept: Sequence[tuple[Array, Array]]) -> Array:
    # what is computed moves by A theta + B (y - Y theta); y, the block for fixed theta, is independent of theta
    A = np.nan_to_num(each.by_shared)
    if each.family is None or each.by_block is None:
        return np.asarray(((A @ shared[np.ix_(each.columns, each.columns)]) * A).sum(-1))
    inverse, Y = kept[each.family]
    B = np.nan_to_num(each.by_block)
    H = -B @ Y
    H[..., _place(each.columns)] += A
    return np.asarray(((H @ shared) * H).sum(-1) + ((B @ inverse) * B).sum(-1))


def _place(columns: NDArray[np.intp]) -> NDArray[np.intp] | slice:
    """Columns for an index: those that follow each other as a slice, which is not copied."""
    if columns.size and columns[-1] - columns[0] + 1 == columns.size and (np.diff(columns) == 1).all():
        return slice(int(columns[0]), int(columns[-1]) + 1)
    return columns


def _scale(S: Array) -> Array:
    diagonal = np.diag(S)
    return 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))


def _flat(A: Array) -> Array:
    return A.reshape(-1, A.shape[-1])

"""What static clutter hides a part of and no track has followed yet: a ball that rises along a rope.

In the picture it is one blob with the clutter, so that it would be found only where it is apart. Over the background
what is to be seen of it stands out by itself; a disc like those of the targets is fitted to that, without the pixels
that the clutter may light.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.blobs import Blobs
from vidtrack.tracking.detection.static_clutter import StaticClutter
from vidtrack.tracking.discs.fit_apart import fit_apart
from vidtrack.tracking.discs.joint_fit import JOINT_FIT, shapes_of
from vidtrack.tracking.discs.two_discs import Pair
from vidtrack.tracking.recovery.declumping import looks_of
from vidtrack.tracking.recovery.separation import SEPARATING, cover_discs, hidden_by_static, piece_about
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import Appearance

SHOWN = 0.5
"""Share of a disc's diameter that what is to be seen of it measures, at least, in its longer direction."""


def beside(static: StaticClutter | None, sample: Sample, blobs: Blobs) -> Bools:
    """Which blobs (m,) touch static clutter."""
    if static is None:
        return np.zeros(blobs.Xf.size, bool)
    x, y = blobs.left + (blobs.width - 1) / 2, blobs.top + (blobs.height - 1) / 2 * sample.lines
    return np.asarray(static.touched([sample], x[None], y[None], blobs.width, blobs.height)[0])


def discs_beside(
    sample: Sample,
    blobs: Blobs,
    which: Ints,
    static: StaticClutter,
    like: Appearance,
    others: tuple[Array, Array],
    detection: Detection,
) -> Iterator[tuple[Array, Array]]:
    """Place (1, 2) px and looks (5,) of each of some blobs over the background that is a disc like the targets.

    blobs   what stands out of the background; which: of them, those that touch the clutter, the most massive first
    like    the looks of the targets, of which some are known
    others  middles (n, 2) and sizes (n, 2) px of what is followed already
    """
    known = like.known
    if not known.any():
        return
    pixels, contrast, size = like.pixels[known], like.contrast[known], like.size[:, known]
    usual = [np.median(column, axis=-1, keepdims=True) for column in (pixels, size, contrast)]
    shape = shapes_of(*usual)
    axes = np.exp(shape.value[:2])
    room = axes[:, 0] + JOINT_FIT.reach_px + SEPARATING.ring_px
    middle, wide = others
    for i in which.tolist():
        box = np.array([blobs.width[i], blobs.height[i]])
        if (box < 2 * SHOWN * axes[:, 0]).all():
            continue
        column = np.array([blobs.left[i] + (blobs.width[i] - 1) / 2])
        row = np.asarray(sample.row(np.array([blobs.top[i] + (blobs.height[i] - 1) / 2 * sample.lines])))
        inside = np.abs(middle - [column[0], sample.lines * row[0] + sample.parity]) < wide / 2
        if inside.all(axis=1).any():
            continue
        left, top, grey = piece_about(sample, detection, column, row, room)
        hidden = hidden_by_static(static, sample.parity, (left, top), grey.shape)
        half = wide.T / 2 / np.array([[1], [sample.lines]])
        hidden |= cover_discs((left, top), grey.shape, middle[:, 0], np.asarray(sample.row(middle[:, 1])), half)
        fit, piece = fit_apart(grey, hidden, column - left, row - top, shape, detection.noise)
        if fit is None:
            continue
        place = np.stack([fit.x + left, (fit.y + top) * sample.lines + sample.parity], axis=1)
        looks = looks_of(Pair(fit.x, fit.y, fit.shape, piece.background, True))
        yield place, np.concatenate(looks)
        middle, wide = np.vstack([middle, place]), np.vstack([wide, [looks.width[0], looks.height[0] * sample.lines]])

"""Discs by exact area, drawn for tests; shares nothing with the package's own renderer.

A pixel's share of a disc is the mean, over 64 thin horizontal strips, of the exact length of each strip's chord in
the pixel: the only error is that of the strips, below 1e-4 of a pixel.
"""

import numpy as np

STRIPS = 64


def disc(shape, x, y, radius, *, ratio=1.0):
    """Share of each pixel (rows, columns) in an ellipse of half axes radius and ratio * radius, middle (x, y) px."""
    rows, columns = shape
    at = (np.arange(rows * STRIPS) + 0.5) / STRIPS - 0.5
    half = radius * np.sqrt(np.maximum(1 - ((at - y) / (ratio * radius)) ** 2, 0))
    edges = np.arange(columns + 1) - 0.5
    reach = np.clip(edges, (x - half)[:, None], (x + half)[:, None])
    return np.diff(reach, axis=1).reshape(rows, STRIPS, columns).mean(axis=1)


def picture(shape, targets, *, level=30.0, contrast=200.0, noise=0.0, rng=None, dtype=np.uint8, ratio=1.0):
    """A picture of discs (x, y, radius[, contrast]); level may be a picture itself; noise in grey levels."""
    image = np.zeros(shape) + level
    for x, y, radius, *own in targets:
        reach = int(np.ceil(radius + 2))
        top, left = max(0, int(y) - reach), max(0, int(x) - reach)
        bottom, right = min(shape[0], int(y) + reach + 2), min(shape[1], int(x) + reach + 2)
        if bottom > top and right > left:
            piece = disc((bottom - top, right - left), x - left, y - top, radius, ratio=ratio)
            image[top:bottom, left:right] += (own[0] if own else contrast) * piece
    if noise:
        image = image + rng.normal(0, noise, shape)
    if dtype is float:
        return image
    full = 255 if dtype is np.uint8 else 1023
    return np.clip(np.rint(image * (full / 255)), 0, full).astype(dtype)


def windows(n, radius, *, side=32, noise=3.0, contrast=200.0, level=30.0, seed=0, slope=(0.0, 0.0), blur=0.0):
    """n windows (side, n, side) uint8 of one disc each, anywhere in the middle pixel; and the truth (n, 2) px."""
    rng = np.random.default_rng(seed)
    truth = side // 2 + rng.uniform(-0.5, 0.5, (n, 2))
    y, x = np.mgrid[:side, :side] - side / 2
    ramp = level + slope[0] * x + slope[1] * y
    stack = np.stack([disc((side, side), *at, radius) for at in truth], axis=1)
    if blur:
        from scipy.ndimage import gaussian_filter1d

        stack = gaussian_filter1d(gaussian_filter1d(stack, blur, axis=0), blur, axis=2)
    image = ramp[:, None] + contrast * stack + rng.normal(0, noise, (side, n, side))
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), truth

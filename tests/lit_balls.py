"""Matt balls that a lamp lights from one side, drawn by rays: by Lambert's law, and not as the program fits them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

FINE = 6


def picture(shape, balls, *, lamp=(1.0, 0.0, 0.5), ambient=0.3, level=180.0, ground=30.0, blur=0.7, rows=1.0):
    """Grey levels (rows, columns) of balls (x, y, radius) px.

    lamp     towards it: right, down and to the camera; None: light from everywhere. ambient: share of light from there
    rows     px of a row: those of pixels that are not square
    """
    high, wide = shape
    light = np.full((high * FINE, wide * FINE), ground)
    column = (np.arange(wide * FINE) + 0.5) / FINE - 0.5
    row = ((np.arange(high * FINE) + 0.5) / FINE - 0.5) * rows
    for x, y, radius in balls:
        u, v = np.meshgrid((column - x) / radius, (row - y * rows) / radius)
        on = u * u + v * v < 1
        shade = np.ones(on.shape)
        if lamp is not None:
            w = np.sqrt(np.clip(1 - u * u - v * v, 0, 1))
            toward = np.asarray(lamp) / np.linalg.norm(lamp)
            shade = ambient + (1 - ambient) * np.clip(u * toward[0] + v * toward[1] + w * toward[2], 0, None)
        light = np.where(on, level * shade, light)
    return gaussian_filter(light, blur * FINE).reshape(high, FINE, wide, FINE).mean(axis=(1, 3))


def noisy(light, rng, noise=1.5):
    """As a camera of 8 bits has it."""
    return np.clip(np.rint(light + rng.normal(0, noise, light.shape)), 0, 255).astype(np.uint8)

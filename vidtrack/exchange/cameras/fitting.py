"""A camera that sees given rays at given pixels, for lenses that no formula of `geometry.brown` describes.

`geometry.lens_conversion` does this for a `BrownLens`, whose distortion is about the principal point: it inverts that
formula, solves a linear problem, and keeps f and the principal point where they mean the same in both. The distortion
of Argus and OpenPTV is about another point, or skewed after it, so that there is no such formula and nothing to keep:
all terms are fitted to whatever function the program has, of which only the direction from rays to pixels is needed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import Camera, project

TERMS = ("Cx", "Cy", "f", "Sx", "skew", "kappa1", "kappa2", "kappa3", "p1", "p2", "s1", "s2", "q1", "q2")
GRID = 25


def fitted(start: Camera, seen: Callable[[Array], Array]) -> tuple[Camera, float]:
    """The camera nearest to a mapping from tangents X/Z, Y/Z (n, 2) to frame-buffer px (n, 2), and the largest error
    in px.

    start   has the picture's size, the pose, and f and centre nearly right; its lens terms are the start of the fit
    """
    from scipy.optimize import least_squares

    width, height = start.image_size
    corner = np.array([max(start.Cx, width - start.Cx), max(start.Cy, height - start.Cy)])
    reach = 1.1 * corner * [start.dx / start.Sx, start.dy] / start.f
    side = np.linspace(-1, 1, GRID)
    x = np.stack(np.meshgrid(side * reach[0], side * reach[1]), -1).reshape(-1, 2)
    b = seen(x)
    inside = np.isfinite(b).all(-1) & (b >= -1).all(-1) & (b[:, 0] <= width) & (b[:, 1] <= height)
    if inside.sum() < 50:
        raise VidtrackError(
            f"camera {start.name}: its lens shows nothing in a picture of {width} x {height} px. Correct size."
        )
    x, b = x[inside], b[inside]
    rays = np.concatenate([x, np.ones((len(x), 1))], -1)
    at = start.with_(R=np.eye(3), T=np.zeros(3))
    radius = float(np.hypot(*(corner * [start.dx, start.dy])))
    scale = {"Cx": 1.0, "Cy": 1.0, "f": start.f / 100, "Sx": 0.01, "skew": 0.01}
    scale |= {"kappa1": radius**-2, "kappa2": radius**-4, "kappa3": radius**-6, **dict.fromkeys(TERMS[8:], 1 / radius)}

    def camera_at(values: Array) -> Camera:
        return at.with_(**{name: getattr(start, name) + scale[name] * v for name, v in zip(TERMS, values, strict=True)})

    def error(values: Array) -> Array:
        try:
            miss = project(camera_at(values), rays) - b
        except ValueError:
            return np.full(b.size, 1e3)
        return np.where(np.isfinite(miss), miss, 1e3).ravel()

    best = least_squares(error, np.zeros(len(TERMS)), xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=60)
    worst = float(np.abs(best.fun).max())
    return camera_at(best.x).with_(R=start.R, T=start.T), worst

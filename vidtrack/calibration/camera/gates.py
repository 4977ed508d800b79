"""Checks of calibration points and cameras: each names the reason and the cure.

Those that find that no camera can be had return the line of the refusal; those that find it will be poor return a
Finding; None where all is well. The caller adds which camera it is about. The limits come from trials: see each
constant.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.calibration.camera.dlt import decomposed, dlt
from vidtrack.calibration.camera.lens_selection import points_needed
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.calibration.camera.tsai import centred, closed_form
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera, distorted_from_frame_buffer, fold_radius
from vidtrack.geometry.lens_terms import RADIAL

FLAT = 0.005
"""Third over first singular value of the points about their mean: at 0.0056 f comes out 5 % wrong, at 0.0006, 68 %."""

NEARLY_FLAT = 0.06
"""At 0.028 f is still 0.6 % wrong."""

LINEAR_NEEDS = 7


def too_few(n: int, refine: str, model: str = "tsai", coplanar: bool = False, known: int = 0) -> str | None:
    """Refuse: fewer points than the method needs: 7 for the closed form, 11 for the full fit with nothing known.

    known  how many of the model's parameters calibration.fix holds or calibration.prior gives
    """
    linear = refine in ("linear", "centre")
    plain = "tsai" if model == "auto" else model
    needed = (5 if coplanar else LINEAR_NEEDS) if linear else full_fit_needs(plain, known)
    if n >= needed:
        return None
    if not linear and n == FEWEST - 1 and known >= points_needed(plain) - 6:
        return (
            "3 usable calibration points; placing a camera whose lens is known needs 4, as 3 leave up to four places. "
            "Add a point."
        )
    method = f"the {'coplanar' if coplanar else 'noncoplanar'} closed form" if linear else f"the full fit of {plain}"
    freed = points_needed(plain) - known
    of = "" if linear else f" for its {freed} free parameters"
    cures = ["Add points"]
    if not linear and n >= LINEAR_NEEDS and not coplanar:
        cures.append("set calibration.refine: linear, which needs 7")
    if not linear and n >= FEWEST:
        enough = next((k for k in range(known + 1, 6) if full_fit_needs(plain, k) <= n), None)
        if enough is not None:
            more = f"{enough - known} more " if known else f"{enough} "
            cures.append(f"hold {more}of kappa1, Sx, Cx, Cy, f with calibration.fix, as far as you know them")
    return f"{n} usable calibration points; {method} needs {needed}{of}. {', or '.join(cures)}."


FEWEST = 4
"""Points that place a camera whose lens is known."""


def full_fit_needs(model: str, known: int) -> int:
    """Points that a full fit needs: one for each parameter; where some are known, 4 equations more than unknowns, and
    4 points where only the attitude and the place are sought."""
    freed = points_needed(model) - known
    if not known:
        return freed
    return FEWEST if freed <= 6 else (freed + 5) // 2


def flatness(p: ArrayLike) -> float:
    """Third over first singular value of points (n, 3) about their mean: 0 for points in one plane."""
    s = np.linalg.svd(centred(np.asarray(p, float))[1], compute_uv=False)
    return float(s[2] / s[0]) if len(s) == 3 and s[0] > 0 else 0.0


FAR = 30.0
"""Times as far from the middle as all other points: no camera sees both, and a digit or a decimal point is wrong."""


def far_off(p: ArrayLike) -> str | None:
    """Refuse: one point that lies far away from all others (n, 3), whose place is mistyped."""
    p = np.asarray(p, float)
    if len(p) < 4:
        return None
    away = np.linalg.norm(p - np.median(p, axis=0), axis=1)
    last = int(np.argmax(away))
    others = float(np.delete(away, last).max())
    if not (others > 0 and away[last] > FAR * others):
        return None
    place = ", ".join(f"{value:.10g}" for value in p[last])
    return (
        f"the point at ({place}) lies {away[last] / others:.2g} times as far from the middle as any other: a digit or "
        "a decimal point is wrong there. Correct it."
    )


def straight(p: ArrayLike) -> str | None:
    """Refuse: all points on one line, from which no camera follows, or one so far away that they seem to be."""
    if mistyped := far_off(p):
        return mistyped
    s = np.linalg.svd(centred(np.asarray(p, float))[1], compute_uv=False)
    if not s[0] > 0:
        return f"the {len(np.asarray(p))} points have one and the same place. Give each its own x, y, z in points.csv."
    if s[1] >= FLAT * s[0]:
        return None
    cure = degrees(p) or "Spread them over all three axes."
    return f"the {len(np.asarray(p))} points lie on one line. {cure}"


def degrees(p: ArrayLike) -> str:
    """The cure where x and y look like latitude and longitude: far from 0 beside their spread, and within degrees."""
    xy = np.asarray(p, float)[:, :2]
    middle, spread = np.abs(np.median(xy, axis=0)), np.ptp(xy, axis=0)
    if not (middle > 20 * spread).all() or not (0 < spread.max() < 1) or middle.min() > 90 or middle.max() > 180:
        return ""
    return (
        f"x and y about {xy[0, 0]:.4f}, {xy[0, 1]:.4f} look like latitude and longitude in degrees: convert them to "
        "east and north in `units` (a local grid or UTM)."
    )


def coplanar(p: ArrayLike, refine: str, fixed: Sequence[str]) -> str | None:
    """Refuse: points in one plane, unless what one plane cannot determine is held (Sx; and Cx, Cy in a full fit)."""
    ratio = flatness(p)
    held = ("Sx",) if refine in ("linear", "centre") else ("Sx", "Cx", "Cy")
    if ratio >= FLAT or set(held) <= set(fixed):
        return None
    return (
        f"the {len(np.asarray(p))} points are coplanar (third over first singular value {ratio:.4f}, below {FLAT}): "
        f"one plane does not determine Sx and the principal point. "
        + (
            degrees(p)
            or "Add points at least a tenth of the target's width off the plane; or set calibration.fix: [Sx, Cx, Cy] "
            "for the full fit, or calibration.refine: linear and calibration.fix: [Sx] for the coplanar closed form: "
            "both take Sx = 1 and the principal point as given."
        )
    )


def nearly_coplanar(p: ArrayLike) -> Finding | None:
    """Warn: points so near to one plane that f and the distance trade off."""
    ratio = flatness(p)
    if not FLAT <= ratio < NEARLY_FLAT:
        return None
    return Finding(
        "doubtful",
        "points-nearly-coplanar",
        f"the points are nearly coplanar (third over first singular value {ratio:.3f}, below {NEARLY_FLAT}): f, the "
        f"distance and the principal point cannot be separated well.",
        "Add points farther off the plane.",
    )


def facing(camera: Camera, p: ArrayLike, limit_deg: float = 10.0) -> Finding | None:
    """Warn: a plane of points seen nearly square on, where f and the distance cannot be distinguished."""
    _, q, _ = centred(np.asarray(p, float))
    normal = np.linalg.svd(q, full_matrices=False)[2][2]
    angle = float(np.degrees(np.arccos(min(1.0, abs(float(camera.R[2] @ normal))))))
    if angle > limit_deg:
        return None
    return Finding(
        "doubtful",
        "plane-seen-square-on",
        f"the plane of the points is within {angle:.0f} deg of fronto-parallel: focal length and distance cannot be "
        "separated.",
        "Tilt it by 30 deg or more.",
    )


def handedness(p: ArrayLike, b: ArrayLike, Cx: float, Cy: float, dx: float, dy: float) -> int:
    """-1 where the points can only be seen by a mirrored camera, 1 where by a true one, 0 where too flat to decide.

    Two independent signs must agree on a mirror: the DLT's determinant, and Tsai's f or depths below 0.
    """
    p, b = np.asarray(p, float), np.asarray(b, float)
    if flatness(p) < FLAT:
        return 0
    try:
        direct = decomposed(dlt(p, b))
    except np.linalg.LinAlgError:  # the points settle no matrix
        return 0
    s = closed_form(p, b, Cx=Cx, Cy=Cy, dx=dx, dy=dy)
    votes = (float(s.f) > 0) and bool((s.depth > 0).mean() > 0.5)
    if direct.handed < 0:
        return 0 if votes else -1
    return 1


def mirrored(sense: int) -> str | None:
    """Refuse: a camera that would need mirrored axes (f or depths below 0)."""
    if sense >= 0:
        return None
    return (
        "mirrored axes: the points fit only a camera with a negative focal length, with every depth behind it. "
        "The world axes must be right-handed (x to y turns as z points) and Yf must run down the picture: "
        "negate one column of points.csv or exchange two, or flip the picture back."
    )


OF_CORNERS = 0.02
"""Share of the picture that has no line of sight, up to which it is its corners: what is seen there has no position and
its flag, and all else is as it would be."""


def folded(camera: Camera) -> Finding | None:
    """Warn: a lens model that turns back on itself inside the picture; in its corners alone it is a note."""
    fold = fold_radius(camera)
    if not np.isfinite(fold):
        return None
    width, height = camera.image_size
    x, y = np.meshgrid(np.linspace(-0.5, width - 0.5, 65), np.linspace(-0.5, height - 0.5, 65))
    r = np.hypot(*np.moveaxis(distorted_from_frame_buffer(camera, np.stack([x, y], -1)), -1, 0))
    share = float((r > fold).mean())
    if share == 0:
        return None
    # at the fold 1 + 3 kappa1 r^2 + 5 kappa2 r^4 + ... = 0: the term that is most negative there folds the model
    share_of = {name: (2 * n + 1) * getattr(camera, name) * fold ** (2 * n) for n, name in enumerate(RADIAL, 1)}
    term = min(share_of, key=lambda name: share_of[name])
    value = getattr(camera, term)
    richer = "calibration.model: auto, or " if term == "kappa1" and not camera.kappa2 else ""
    cure = f"or set {richer}calibration.fix: [{term}]"
    return Finding(
        "note" if share <= OF_CORNERS else "doubtful",
        "lens-model-folds",
        f"{term} = {value:.3g} folds the lens model inside the picture, {fold / camera.dy:.0f} px from the "
        f"principal point: {max(100 * share, 1):.0f} % of the picture has no line of sight.",
        f"Add points near the corners, {cure}.",
    )


SMALL_HULL = 0.04
"""Share of the picture below which the hull of the points leaves the lens and the principal point undetermined."""


def bunched(b: ArrayLike, image_size: tuple[int, int]) -> Finding | None:
    """Warn: points bunched in a corner of the picture, or in a small part of it."""
    b = np.asarray(b, float)
    width, height = image_size
    low, high = b.min(0), b.max(0)
    span = (high - low) / (width, height)
    where = ((low + high) / 2 + 0.5) / (width, height) - 0.5  # from the middle, in pictures
    share = hull_area(b) / (width * height)
    corner = bool((span < 0.5).all() and (np.abs(where) > 0.12).all())
    if not corner and share >= SMALL_HULL:
        return None
    sides = f"{'upper' if where[1] < 0 else 'lower'} {'left' if where[0] < 0 else 'right'} corner"
    place = f"bunched in the {sides} of the picture" if corner else "bunched in a small part of the picture"
    return Finding(
        "doubtful",
        "points-bunched",
        f"the points are {place} ({100 * share:.0f} % of its area): outside the region that they cover, lens and "
        "principal point are extrapolated.",
        "Spread the points over the image.",
    )


def hull_area(b: Array) -> float:
    """Area, px^2, of the convex hull of positions (n, 2); 0 for points on one line."""
    import cv2

    return float(cv2.contourArea(cv2.convexHull(np.ascontiguousarray(b, np.float32))))


UNSURE_CENTRE_PX = 25.0
UNSURE_F = 0.03


def unsure(camera: Camera, uncertainty: Uncertainty) -> Finding | None:
    """Warn: standard errors so large that the points do not settle the camera: too shallow, too few or too noisy."""
    sd = dict(zip(uncertainty.names, uncertainty.standard_errors.tolist(), strict=True))
    wide = [f"{name} +- {sd[name]:.0f} px" for name in ("Cx", "Cy") if sd.get(name, 0) > UNSURE_CENTRE_PX]
    if sd.get("f", 0) > UNSURE_F * camera.f:
        wide.append(f"f +- {100 * sd['f'] / camera.f:.0f} %")
    if not wide:
        return None
    return Finding(
        "note",
        "parameters-uncertain",
        f"the points leave {', '.join(wide)}.",
        "Add points at other depths (half the distance deep is good), or set a calibration.prior or calibration.fix "
        "for what you know.",
    )


def plain_lens(plain_px: float, rich_px: float, model: str) -> Finding | None:
    """Warn: a lens model that leaves much more error than richer ones do; both errors with parameters counted."""
    if not rich_px < 0.8 * plain_px:
        return None
    return Finding(
        "doubtful",
        "lens-model-too-plain",
        f"the lens model {model} leaves {plain_px:.2g} px where a richer one leaves {rich_px:.2g} px.",
        "Set calibration.model: auto.",
    )


def swapped(tag: str, other: str) -> Finding:
    """Warn: two tags that lie at each other's places."""
    return Finding(
        "doubtful",
        "tags-swapped",
        f"tags {tag} and {other} are swapped: each lies where the other should be. Both are left out.",
        "Exchange them in picks.csv or points.csv.",
    )


def disagreeing(kept: int, n: int) -> str | None:
    """Refuse: most points disagree with the camera that the others make."""
    if kept >= n / 2:
        return None
    return (
        f"only {kept} of {n} points agree on one camera. Check that the tags go with the right balls, "
        f"that points.csv is right-handed, and that the camera did not move between clips."
    )


def at_edge(Cx: float, Cy: float, reach: float) -> Finding:
    """Warn: the centre search ended at the edge of its reach."""
    return Finding(
        "doubtful",
        "centre-at-edge",
        f"the best centre lies at the edge of the search, {reach:g} px from Cx {Cx:g}, Cy {Cy:g}.",
        "Move Cx and Cy there, or set calibration.refine: full.",
    )

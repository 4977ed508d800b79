"""A known lens: what the config's section `lens` means for the pictures of a camera."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from vidtrack.calibration.camera.known_lens import KnownLens
from vidtrack.calibration.camera.refine import POSE
from vidtrack.errors import VidtrackError
from vidtrack.exchange.lens_files import read_lens
from vidtrack.files.camera_json import read_camera
from vidtrack.geometry.brown import BrownLens
from vidtrack.geometry.lens_conversion import camera_from_brown, inner_covariance

SAME_SHAPE = 0.005
"""Share by which the sides of two pictures may differ in shape and still show the same."""


NOTHING = BrownLens(0.0, 0.0, 0.0, 0.0, (0, 0))
NUMBERS = ("fx", "fy", "cx", "cy", "p1", "p2", "k1", "k2", "k3", "k4")


def known_lens(given: Mapping[str, Any], path: str | None, camera: str, image_size: tuple[int, int]) -> KnownLens:
    """The lens that the config's section `lens` describes, for pictures of `image_size` (width, height) px.

    given   the section: camera, use, and fx, fy, ... where there is no file
    path    of its file; None where the numbers stand in the config
    Raises VidtrackError, one line: a file that holds no lens, or pictures of another shape.
    """
    where = path or f"config.yaml: cameras.{camera}.calibration.lens"
    own = _own_camera(path) if path else None
    if own is not None:
        if any(given.get(name) is not None for name in NUMBERS):
            raise VidtrackError(f"{where}: numbers beside a camera.json. Remove the numbers from the config.")
        return _used(_resized(own, image_size, where), given, where)
    try:
        lens, sd = read_lens(path, given.get("camera") or camera) if path else (NOTHING, {})
        lens = _with_numbers(lens, given, image_size)
        sd = sd | dict(given.get("sd") or {})
        lens = _scaled(lens, image_size, where)
        done = camera_from_brown(lens)
        names, covariance = inner_covariance(lens, sd, done.model) if sd else ((), None)
    except (ValueError, KeyError, TypeError, IndexError, OverflowError, RecursionError) as error:
        raise VidtrackError(f"{where}: holds no lens that can be used: {str(error)[:150]}.") from None
    source = where if done.covered > 0.999 else f"{where} (it sees {100 * done.covered:.0f} % of the picture)"
    return _used(
        KnownLens(done.camera, done.model, names, covariance, source, done.largest_px, done.rms_px), given, where
    )


def _used(lens: KnownLens, given: Mapping[str, Any], where: str) -> KnownLens:
    use = given.get("use") or ("prior" if lens.names else "fixed")
    if use == "fixed":
        return lens._replace(names=(), covariance=None)
    if not lens.names:
        raise VidtrackError(f"{where}: gives no covariance, so it cannot be a prior. Set use: fixed, or give sd.")
    return _determined(lens)


def _determined(lens: KnownLens) -> KnownLens:
    """The lens without the parameters that are known exactly: a prior is of those that are not."""
    assert lens.covariance is not None
    known = np.sqrt(np.diag(lens.covariance))
    size = np.array([abs(getattr(lens.camera, name)) for name in lens.names])
    keep = np.flatnonzero(known > 1e-9 * np.maximum(size, 1e-12))
    C = lens.covariance[np.ix_(keep, keep)]
    spread = np.sqrt(np.diag(C))
    unit = C / np.outer(spread, spread)
    values = np.linalg.eigvalsh(unit)
    if len(values) and values[0] < 1e-9:  # numbers that move together: two of them are one unknown
        C = C + np.diag(spread**2) * (1e-9 - min(values[0], 0.0))
    return lens._replace(names=tuple(lens.names[i] for i in keep), covariance=C)


def _own_camera(path: str) -> KnownLens | None:
    """The lens of a camera.json of vidtrack; None where the file is no such."""
    if not path.lower().endswith(".json"):
        return None
    try:
        with open(path, encoding="utf-8-sig") as file:
            record = json.load(file)
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(record, dict) or not {"Cx", "f", "kappa1", "Sx"} <= set(record):
        return None
    found = read_camera(path)
    model = str(found.record.get("model", "tsai"))
    names: tuple[str, ...] = ()
    covariance = None
    if found.uncertainty is not None:
        inner = [i for i, name in enumerate(found.uncertainty.names) if name not in POSE]
        names = tuple(found.uncertainty.names[i] for i in inner)
        covariance = found.uncertainty.covariance[np.ix_(inner, inner)]
        if not np.isfinite(covariance).all():
            names, covariance = (), None
    return KnownLens(found.camera, model, names, covariance, path)


def _resized(lens: KnownLens, image_size: tuple[int, int], where: str) -> KnownLens:
    scale = _scale(lens.camera.image_size, image_size, where)
    if scale == 1:
        return lens
    camera = lens.camera.with_(
        image_size=image_size,
        Cx=(lens.camera.Cx + 0.5) * scale - 0.5,
        Cy=(lens.camera.Cy + 0.5) * scale - 0.5,
        dx=lens.camera.dx / scale,
        dy=lens.camera.dy / scale,
    )
    by = np.array([scale if name in ("Cx", "Cy") else 1.0 for name in lens.names])
    covariance = None if lens.covariance is None else lens.covariance * np.outer(by, by)
    return lens._replace(camera=camera, covariance=covariance, source=f"{where}, scaled by {scale:g}")


def _scaled(lens: BrownLens, image_size: tuple[int, int], where: str) -> BrownLens:
    scale = _scale(lens.image_size, image_size, where)
    return lens._replace(
        fx=lens.fx * scale,
        fy=lens.fy * scale,
        cx=(lens.cx + 0.5) * scale - 0.5,
        cy=(lens.cy + 0.5) * scale - 0.5,
        skew=lens.skew * scale,
        image_size=image_size,
    )


def _scale(of: tuple[int, int], image_size: tuple[int, int], where: str) -> float:
    """How many times larger the pictures are than those of the lens; VidtrackError where their shapes differ."""
    if 0 in of:
        return 1.0
    across, down = image_size[0] / of[0], image_size[1] / of[1]
    if abs(across / down - 1) > SAME_SHAPE:
        raise VidtrackError(
            f"{where}: the lens is that of pictures of {of[0]} x {of[1]} px, the clips have {image_size[0]} x "
            f"{image_size[1]}: another shape, so that it is not known which part they show. Calibrate the lens in the "
            "camera's present mode."
        )
    return across


def _with_numbers(lens: BrownLens, given: Mapping[str, Any], image_size: tuple[int, int]) -> BrownLens:
    """The lens, with the numbers that the config gives in place of its own."""
    numbers = {name: float(given[name]) for name in NUMBERS if given.get(name) is not None}
    if size := given.get("image_size") or (image_size if lens.image_size == (0, 0) else None):
        lens = lens._replace(image_size=(int(size[0]), int(size[1])))
    width, height = lens.image_size
    if lens.fx == 0:
        numbers = {"fy": numbers["fx"], "cx": (width - 1) / 2, "cy": (height - 1) / 2} | numbers
    k = list(lens.k) + [0.0] * (4 - len(lens.k))
    k = [numbers.pop(f"k{n}", value) for n, value in enumerate(k, 1)]
    fisheye = lens.fisheye or bool(given.get("fisheye"))
    if k[3] and not fisheye and not lens.k[3:]:
        raise ValueError("k4 is a number of a fisheye lens: set fisheye: true")
    return lens._replace(k=tuple(k), fisheye=fisheye)._replace(**numbers)  # type: ignore[arg-type]

"""anipose (aniposelib): calibration.toml, `[cam_0] name size matrix distortions rotation translation`, and
`[metadata]`.

matrix and distortions are OpenCV's (the centre of the first pixel is (0, 0); k1 k2 p1 p2 k3, or four of a fisheye
lens where `fisheye = true`), rotation is Rodrigues' vector, c = R p + translation, right-handed, in the board's
unit, which the file does not name. A camera is chosen by its name. Pose2Sim and caliscope write the same with four
distortions (k1 k2 p1 p2). Source: aniposelib cameras.py.
"""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.given import Given, Said, chosen, of_lens, rotation
from vidtrack.exchange.text import Path, text_of
from vidtrack.geometry.brown import BrownLens


def read(path: Path, said: Said) -> Given:
    """One camera of a calibration."""
    try:
        sections = tomllib.loads(text_of(path))
    except tomllib.TOMLDecodeError as error:
        raise VidtrackError(f"{path}: not TOML ({error}). Copy the whole file again.") from None
    except RecursionError:
        raise VidtrackError(f"{path}: not a camera's TOML (nested too deep). Copy the whole file again.") from None
    cameras = [own for own in sections.values() if isinstance(own, dict) and "matrix" in own]
    if not cameras:
        raise VidtrackError(f"{path}: no camera with a matrix in it. Put anipose's calibration.toml there.")
    own = cameras[chosen([str(each.get("name", k)) for k, each in enumerate(cameras)], said, path)]
    if missing := [key for key in ("size", "distortions", "rotation", "translation") if key not in own]:
        raise VidtrackError(f"{path}: camera {own.get('name', '?')} has no {missing[0]}. Calibrate it again.")
    K, d = _array(own, "matrix", path, 9).reshape(3, 3), _array(own, "distortions", path)
    size = _array(own, "size", path, 2)
    try:
        lens = lens_of(K, d, (int(size[0]), int(size[1])), bool(own.get("fisheye", False)))
    except ValueError as error:
        raise VidtrackError(f"{path}: camera {own.get('name', '?')} has {error}. Calibrate it again.") from None
    return of_lens("anipose", lens, rotation(own["rotation"], path), _array(own, "translation", path, 3), said)


def lens_of(K: np.ndarray[Any, Any], d: np.ndarray[Any, Any], size: tuple[int, int], fisheye: bool) -> BrownLens:
    """OpenCV's matrix and distortions; four of a fisheye lens, else k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]].

    ValueError where a tilted sensor follows (tau_x, tau_y).
    """
    d = np.asarray(d, float).ravel()
    fx, fy, cx, cy, skew = (float(v) for v in (K[0, 0], K[1, 1], K[0, 2], K[1, 2], K[0, 1]))
    if fisheye:
        return BrownLens(fx, fy, cx, cy, size, tuple(d[:4].tolist()), skew=skew, fisheye=True)
    d = np.concatenate([d, np.zeros(max(0, 12 - d.size))])
    if d[12:].any():
        raise ValueError("a tilted sensor (tau_x, tau_y), which has no counterpart here")
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = d[:12].tolist()
    bottom = (k4, k5, k6) if any((k4, k5, k6)) else ()
    return BrownLens(fx, fy, cx, cy, size, (k1, k2, k3), p1, p2, bottom, (s1, s2, s3, s4), skew)


def _array(own: dict[str, Any], key: str, path: Path, size: int | None = None) -> np.ndarray[Any, Any]:
    try:
        values = np.asarray(own[key], float).ravel()
    except (TypeError, ValueError):
        values = np.array([np.nan])
    if not np.isfinite(values).all() or (size is not None and values.size != size):
        raise VidtrackError(
            f"{path}: {key} of camera {own.get('name', '?')} is not {size or 'some'} numbers. Correct the file."
        )
    return values

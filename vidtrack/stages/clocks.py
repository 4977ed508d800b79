"""Stage clocks: estimates of the cameras' clocks from the sound and the light of a run's recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from vidtrack.timing.agreement import NOT_ESTIMATED, Timing
from vidtrack.timing.flash import timing_from_flash
from vidtrack.timing.resample import exposures_begun
from vidtrack.timing.sound import timing_from_sound

ALONE_S = 1.0
"""s: changes of light that one pair of cameras has only one of must not lie further apart to be taken for one."""

DAY = 86400.0


def clocks(
    light: Mapping[str, pd.DataFrame],
    sounds: Mapping[str, tuple[float, ArrayLike]],
    *,
    rate_hz: float,
    references: Sequence[str],
    sought: Mapping[str, Sequence[str]],
) -> dict[str, Any]:
    """The estimate of each wanted clock by each method.

    light        camera: table of middle_s (s, camera time of the middle of each picture's exposure) and brightness
                 (grey levels; NaN where damaged)
    sounds       camera: camera time of the first sample, s, and samples (n,) at rate_hz; those that have sound
    references   cameras whose clock is right; the first that has something in common with a camera is the one
    sought       camera: "sound", "flash"
    For each camera and method: reference; offset_s and rate_ppm, to be added to the camera's time to give the
    reference's, at at_s of its time; offset_s_sd, rate_ppm_sd, covariance (2, 2; s and ppm; without what sound needs
    to travel); n of `of` windows or changes that agree. Only n and `of` where there is no estimate.
    """

    def of_sound(reference: str, camera: str) -> tuple[Timing, float]:
        if reference not in sounds or camera not in sounds:
            return NOT_ESTIMATED, 0.0
        (a, x), (b, y) = sounds[reference], sounds[camera]
        return timing_from_sound(np.asarray(x), np.asarray(y), rate_hz, start_a=a, start_b=b + _days(a, b)), b

    def of_flash(reference: str, camera: str) -> tuple[Timing, float]:
        (a, x), (b, y) = (_exposures(light[name]) for name in (reference, camera))
        if a.size < 4 or b.size < 4:
            return NOT_ESTIMATED, 0.0
        timing = timing_from_flash(a, x, b + _days(a[0], b[0]), y, shutter=None, alone_s=ALONE_S)
        return timing, float(b[0])

    by: dict[str, Callable[[str, str], tuple[Timing, float]]] = {"sound": of_sound, "flash": of_flash}
    return {
        camera: {method: _first_estimate(by[method], references, camera) for method in methods}
        for camera, methods in sought.items()
    }


def heard_cameras(cameras: Sequence[str], references: Sequence[str], sought: Mapping[str, Sequence[str]]) -> list[str]:
    """The cameras whose sound is needed: none where no clock is sought in it, else those and the references."""
    by_sound = [camera for camera, methods in sought.items() if "sound" in methods]
    return [camera for camera in cameras if by_sound and (camera in references or camera in by_sound)]


def _first_estimate(
    method: Callable[[str, str], tuple[Timing, float]], references: Sequence[str], camera: str
) -> dict[str, Any]:
    """The estimate of a camera's clock by a method, against the first reference with which it gives one."""
    n = of = 0
    for reference in references:
        timing, at_s = method(reference, camera)
        if timing.is_known:
            return {
                "reference": reference,
                "offset_s": timing.clock.offset_s,
                "rate_ppm": timing.clock.rate_ppm,
                "at_s": at_s,
                "offset_s_sd": timing.sd.offset_s,
                "rate_ppm_sd": timing.sd.rate_ppm,
                "covariance": timing.covariance.tolist(),
                "n": timing.n,
                "of": timing.of,
            }
        n, of = max(n, timing.n), max(of, timing.of)
    return {"n": n, "of": of}


def _days(a: float, b: float) -> float:
    """What brings camera time b to the day of a, s."""
    return DAY * round((a - b) / DAY)


def _exposures(table: pd.DataFrame) -> tuple[Any, Any]:
    """When each exposure began, s, and how bright the pictures were."""
    return exposures_begun(table["middle_s"]), table["brightness"].to_numpy(float)

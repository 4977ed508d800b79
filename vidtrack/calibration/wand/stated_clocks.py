"""When each camera saw the wand, by the clocks that are stated; the others must come from the wand's own motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from vidtrack.arrays import Array
from vidtrack.timing.run_scale import run_scale
from vidtrack.timing.timecode import Timecode

FROM_MOTION = ("motion", "auto", "sound", "flash")
"""Clocks of the config that the wand's motion gives."""


class StatedTimes(NamedTuple):
    """times: camera, (n,) s on the scale of all; unknown: cameras whose clocks are still to be found."""

    times: dict[str, Array]
    unknown: list[str]


def stated_times(
    times: Mapping[str, Array], codes: Mapping[str, Timecode | None], clocks: Mapping[str, Any], where: str = ""
) -> StatedTimes:
    """The times of all cameras on one scale, as far as time code and config state it.

    times   camera: (n,) s by its own clock
    codes   camera: time code of its first frame; None where it has none
    clocks  camera: offset_s and rate_ppm, a word of the config, or None where it says nothing
    Without any time code, cameras of which the config says nothing are unknown too.
    """
    shift = run_scale(codes, where).shift
    uncoded = all(code is None for code in codes.values())
    done, unknown = {}, []
    for camera, own in times.items():
        t, clock = own + shift.get(camera, 0.0), clocks[camera]
        if isinstance(clock, Mapping):
            t = t + clock["offset_s"] + clock["rate_ppm"] * 1e-6 * (t - t.min())
        elif clock in FROM_MOTION or uncoded:
            unknown.append(camera)
        done[camera] = t
    return StatedTimes(done, unknown)

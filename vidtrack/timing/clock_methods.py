"""The methods that estimate a camera's clock, by what the config says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.timing.clock import Clock
from vidtrack.timing.timecode import Timecode

METHODS = {
    "auto": ("motion", "sound", "flash"),
    "motion": ("motion",),
    "sound": ("sound",),
    "flash": ("flash",),
}


def methods_of(clocks: Sequence[Any]) -> list[tuple[str, ...]]:
    """The methods that estimate each camera's clock: () where it is given, and for the first camera where none is.

    clocks   a word of METHODS, or anything else where the clock is given
    """
    methods = [METHODS.get(own, ()) if isinstance(own, str) else () for own in clocks]
    return methods if () in methods or not methods else [(), *methods[1:]]


def given_clocks(
    names: Sequence[str], clocks: Mapping[str, Mapping[str, float] | str] | str | None
) -> list[Clock | str]:
    """Of each camera its clock where it is given, with nothing to add where nothing is said, or a word of METHODS.

    clocks   camera: a word, or offset_s and rate_ppm; or one word for all cameras
    """
    given: list[Clock | str] = []
    for name in names:
        own = clocks if clocks is None or isinstance(clocks, str) else clocks.get(name)
        given.append(own if isinstance(own, str) else Clock(**own) if own is not None else Clock())
    return given


def clocks_to_use(clocks: Mapping[str, Any], codes: Mapping[str, Timecode | None], together: bool) -> dict[str, Any]:
    """Each camera's clock as the config says it; where it says nothing, by the motion if no time code relates it.

    clocks    camera: a word of METHODS, offset and rate, or None where the config says nothing
    codes     camera: time code of its recording's first frame; None where it has none
    together  whether another program recorded all cameras at the same moments
    """
    bare = {name for name, code in codes.items() if code is None} if len(codes) > 1 and not together else set()
    sought = set(clocks) if len(bare) == len(codes) and bare else bare
    return {name: own if own is not None else "motion" if name in sought else {} for name, own in clocks.items()}

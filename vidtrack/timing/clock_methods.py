"""The methods that estimate a camera's clock, by what the config says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

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


def clocks_to_use(clocks: Mapping[str, Any], codes: Mapping[str, Timecode | None], together: bool) -> dict[str, Any]:
    """Each camera's clock as the config says it; where it says nothing, by the motion if no time code relates it.

    clocks    camera: a word of METHODS, offset and rate, or None where the config says nothing
    codes     camera: time code of its recording's first frame; None where it has none
    together  whether another program recorded all cameras at the same moments
    """
    bare = {name for name, code in codes.items() if code is None} if len(codes) > 1 and not together else set()
    sought = set(clocks) if len(bare) == len(codes) and bare else bare
    return {name: own if own is not None else "motion" if name in sought else {} for name, own in clocks.items()}

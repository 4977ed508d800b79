"""The methods that estimate a camera's clock, by what the config says of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

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

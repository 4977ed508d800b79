"""The methods that estimate a camera's clock, by what the config says of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

WITNESSES = {
    "auto": ("motion", "sound", "flash"),
    "motion": ("motion",),
    "sound": ("sound",),
    "flash": ("flash",),
}


def asked(clocks: Sequence[Any]) -> list[tuple[str, ...]]:
    """The methods that estimate each camera's clock: () where it is given, and for the first camera where none is.

    clocks   a word of WITNESSES, or anything else where the clock is given
    """
    witnesses = [WITNESSES.get(own, ()) if isinstance(own, str) else () for own in clocks]
    return witnesses if () in witnesses or not witnesses else [(), *witnesses[1:]]

"""The header of a CSV file: which column is meant, whatever its case, and the unit that stands beside its name."""

from __future__ import annotations

import re
from collections.abc import Sequence

from vidtrack.lengths import WORDS

UNITS = {
    **WORDS,
    "px": ("px", "pix", "pixel", "pixels"),
    "s": ("s", "sec", "secs", "second", "seconds"),
    "ms": ("ms", "msec", "millisecond", "milliseconds"),
    "us": ("us", "µs", "μs"),
    "min": ("min", "minute", "minutes"),
    "h": ("h", "hour", "hours"),
    "deg": ("deg", "degree", "degrees", "°"),
}
"""Units as headers write them. Those of length can be compared with the config's `units`."""

LENGTHS = frozenset(WORDS)
TIMES = frozenset({"s", "ms", "us", "min", "h"})

_BY_WORD = {word: unit for unit, words in UNITS.items() for word in words}
_BRACKETED = re.compile(r"(.*?)\s*[(\[{<]\s*([^()\[\]{}<>]*?)\s*[)\]}>]")
_JOINED = re.compile(r"(.*?)[\s_/.,:-]+([^\s_/,:-]+)")


def column_of(cell: str, names: Sequence[str]) -> tuple[str | None, str]:
    """Which of the names a header's cell means, None for none of them, and the unit that it states, "" for none.

    `x`, `X`, `x (mm)`, `X [mm]`, `x_mm` and `x / mm` all mean x. A name that has its unit in itself, as time_s has, is
    also met as `time (s)`. The unit is in short form (mm for millimetres).
    """
    folded = {name.casefold(): name for name in reversed(names)}
    if cell in names:
        return cell, ""
    if cell.casefold() in folded:
        return folded[cell.casefold()], ""
    base, unit = split_unit(cell)
    if not unit:
        return None, ""
    for name in names:
        own_base, own_unit = split_unit(name)
        if own_unit and own_base.casefold() == base.casefold():
            return name, unit
    return folded.get(base.casefold()), unit


def split_unit(cell: str) -> tuple[str, str]:
    """A header's cell without its unit, and the unit in short form; "" where none is known in it."""
    for form in (_BRACKETED, _JOINED):
        parts = form.fullmatch(cell)
        if parts and parts[1]:
            word = parts[2]
            unit = _BY_WORD.get(word) or _BY_WORD.get(word.casefold())
            if unit:
                return parts[1], unit
    return cell, ""

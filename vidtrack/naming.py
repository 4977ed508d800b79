"""Names as people mistype them: the nearest known one."""

from __future__ import annotations

from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """The known name nearest to a mistyped one, or None where nothing is near. `treshold` finds `threshold`."""
    import difflib

    known = list(known)
    for candidate in known:
        if candidate.lower() == name.lower():
            return candidate
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return near[0] if near else None

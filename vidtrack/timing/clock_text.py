"""Times as a person reads them."""

from __future__ import annotations

COUNTED_S = 100.0
"""s: times below count from a first frame, others from midnight."""


def of_day(time_s: float, decimals: int = 3) -> str:
    """Seconds since midnight as hours, minutes and seconds; a day later it is the same time again."""
    unit = 10**decimals
    n = round(time_s * unit) % (86_400 * unit)
    clock = f"{n // (3600 * unit):02d}:{n // (60 * unit) % 60:02d}:{n // unit % 60:02d}"
    return f"{clock}.{n % unit:0{decimals}d}" if decimals else clock


def readable(time_s: float, decimals: int = 1) -> str:
    """10:00:54.4 for seconds since midnight, 3.20 s, with a digit more, for those since a first frame."""
    return of_day(time_s, decimals) if time_s >= COUNTED_S else f"{time_s:.{decimals + 1}f} s"

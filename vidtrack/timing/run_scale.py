"""One scale of time for all cameras of a run, from the time code of each one's first frame.

Each camera's time_s begins with what its own first label shows as a clock. Non-drop labels at 29.97 fall behind a clock
by 1 ms a second: two cameras that started a minute apart by the same generator would be 60 ms apart. So the clock is
read once, off the earliest first label; from there on, frames are counted over the exact rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

from vidtrack.findings import Finding
from vidtrack.timing.timecode import Timecode, frames_in_day

HALF_A_DAY = 43_200


class RunScale(NamedTuple):
    """What is to be added to each camera's time_s, and why.

    shift     camera -> s; 0 for cameras without time code
    note      one sentence for the record; "" where no camera has time code
    findings  where the cameras' codes do not go together
    """

    shift: dict[str, float]
    note: str
    findings: tuple[Finding, ...]


def run_scale(first: Mapping[str, Timecode | None], where: str = "") -> RunScale:
    """The scale of a run.

    first  camera -> the time code of its recording's first frame (TimeBase.first), None where it has none
    where  of the run, for findings
    Labels more than half a day apart lie on both sides of a midnight: the earlier ones are the next day's.
    """
    codes = {name: code for name, code in first.items() if code is not None}
    if not codes:
        return RunScale(dict.fromkeys(first, 0.0), "", ())
    latest = max(code.clock for code in codes.values())
    days = {name: latest - code.clock > HALF_A_DAY for name, code in codes.items()}
    on = {name: code + frames_in_day(code.rate, code.drop) * days[name] for name, code in codes.items()}
    slow = [code for code in on.values() if _falls_behind(code)]
    behind = min((code.clock, code.clock - code.seconds) for code in slow)[1] if slow else Fraction(0)
    shift = dict.fromkeys(first, 0.0)
    for name, code in on.items():
        scale = code.seconds + (behind if _falls_behind(code) else 0)
        shift[name] = float(scale - codes[name].clock)
    return RunScale(shift, _note(on), tuple(_findings(codes, where)))


def code_from_record(record: Mapping[str, Any]) -> Timecode | None:
    """The time code of a recording's first frame from the record of its tracking; None where it has none."""
    code = record.get("time", {}).get("code")
    return Timecode(int(code["frame"]), Fraction(code["rate"]), bool(code["drop"])) if code else None


def code_as_record(code: Timecode | None) -> dict[str, Any] | None:
    """A time code as it is written to JSON, for `code_from_record`."""
    if code is None:
        return None
    return {"label": str(code), "frame": code.frame, "rate": str(code.rate), "drop": code.drop}


def _falls_behind(code: Timecode) -> bool:
    """Whether the labels count slower than a clock: non-drop code at 29.97, 23.976 and 59.94 Hz."""
    return not code.drop and code.rate.denominator != 1


def _kind(code: Timecode) -> str:
    return f"{'drop-frame' if code.drop else 'non-drop'} at {float(code.rate):.6g} Hz"


def _note(codes: Mapping[str, Timecode]) -> str:
    first = min(codes.values(), key=lambda code: code.clock)
    counted = "counted over the exact rate" if _falls_behind(first) else "as its time code counts"
    return f"time_s begins at {float(first.clock):.3f} s, label {first!s} read as clock time, and goes on {counted}"


def _findings(codes: Mapping[str, Timecode], where: str) -> list[Finding]:
    """Codes of several kinds: labels that are alike need not be of one moment."""
    kinds: dict[str, list[str]] = {}
    for name, code in codes.items():
        kinds.setdefault(_kind(code), []).append(name)
    without = {_falls_behind(code) for code in codes.values()}
    if len(without) < 2:
        return []
    counted = "; ".join(f"{', '.join(names)} {kind}" for kind, names in kinds.items())
    apart = max(float(code.seconds - code.clock) for code in codes.values())
    return [
        Finding(
            "doubtful",
            "time-code-kinds-differ",
            f"{where}{': ' if where else ''}the cameras' time codes count differently ({counted}). Where both ran "
            f"on from midnight they are {apart:.2f} s apart; each is taken to be right as a clock at its first frame.",
            "Set one kind of time code in all cameras, or give cameras.<name>.clock (auto seeks it).",
        )
    ]

"""Read-outs of rolling shutters that nothing states: found from the motion, with positions, associations and clocks.

Located with a read-out that is supposed, the lines of sight show how much longer it is (`sight_misses`). That is linear
in small delays only, so the run is located again with what was found, until it stays.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from vidtrack.findings import Finding
from vidtrack.timing.readout import Readout


class SearchSettings(NamedTuple):
    """When a read-out is found."""

    rounds: int = 3
    """Times that the run is located again, at most."""
    same_s: float = 2e-4
    """A read-out that changes by less stays: at 1 m/s it is 0.2 mm."""
    sure: float = 3.0
    """Standard errors that it must differ from none."""
    unsure_s: float = 0.004
    """Standard error from which the motion says too little of it: at 1 m/s it is 4 mm."""


SETTINGS = SearchSettings()


class Sought(NamedTuple):
    """The last locating, the read-outs that it used, their standard errors (s; NaN: not found) and what to say."""

    located: Any
    readouts: dict[str, Readout]
    sd: dict[str, float]
    findings: list[Finding]

    def as_record(self) -> dict[str, Any]:
        """By camera, the read-out that was found and its standard error, s."""
        found = self.readouts
        return {c: {"seconds": found[c].seconds if c in found else None, "sd": sd} for c, sd in self.sd.items()}


def sought_readouts(
    locate: Callable[[Mapping[str, Readout]], Any], readouts: Mapping[str, Readout], sought: Sequence[str], where: str
) -> Sought:
    """Locate with the read-outs of the cameras `sought` found from the motion.

    locate  the run with these read-outs; what it gives has a `record`
    """
    now = dict(readouts)
    done = locate(now)
    sd = dict.fromkeys(sought, np.nan)
    for _ in range(SETTINGS.rounds):
        steps = {}
        for camera in sought:
            left, sd[camera] = _left(done.record, camera)
            found = now[camera].seconds + left if camera in now else np.nan
            if np.isfinite(found):
                none = abs(found) < SETTINGS.sure * sd[camera]
                steps[camera] = -now[camera].seconds if none else left
        if not any(abs(step) > SETTINGS.same_s for step in steps.values()):
            break
        now |= {camera: now[camera]._replace(seconds=now[camera].seconds + step) for camera, step in steps.items()}
        done = locate(now)
    findings = [_unsure(camera, own, where) for camera, own in sd.items() if not own < SETTINGS.unsure_s]
    return Sought(done, now, sd, findings)


def _left(record: Mapping[str, Any], camera: str) -> tuple[float, float]:
    sights = record.get("sight_lines") or {}
    each = [(sights.get(key) or {}).get(camera) for key in ("readout_s", "readout_sd_s")]
    left, sd = (np.nan if value is None else float(value) for value in each)
    return left, sd


def _unsure(camera: str, sd: float, where: str) -> Finding:
    how = "not at all" if np.isnan(sd) else f"only to {1e3 * sd:.2g} ms"
    text = f"{where}: {camera}: the motion shows the read-out of its rows {how}"
    cure = f"Set cameras.{camera}.readout_ms as its maker says, or let targets move fast through many rows."
    return Finding("doubtful", "readout-unsure", text, cure)

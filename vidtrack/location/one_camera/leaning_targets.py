"""Rolling shutters that the pictures of one camera show: moving targets lean.

Lines of sight show a read-out only where cameras see a target in different rows; one camera, and cameras of one height,
show it by the targets' shapes alone (`tracking.uncertainty.leaning`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np

from vidtrack.findings import Finding
from vidtrack.timing.readout import Readout


class Shown(NamedTuple):
    """When a read-out that shapes show is another than the one that is used.

    deviations   standard deviations
    pictures     of the time from one picture to the next, at least; share: of the read-out, that shapes show too little
                 or too much (measured 0.04 and 0.1 on drawn balls of 5 to 16 px radius)
    longest      of the time from one picture to the next
    """

    deviations: float = 6.0
    pictures: float = 0.12
    share: float = 0.1
    longest: float = 1.1


SHOWN = Shown()


def leaning_targets(
    leans: Mapping[str, Mapping[str, float] | None],
    readouts: Mapping[str, Readout],
    intervals: Mapping[str, float],
    reported: Collection[Mapping[str, Any]] = (),
) -> list[Finding]:
    """What to know of cameras whose targets lean otherwise than their read-out makes them.

    leans     camera: `later` and `sd`, samples a row, from the record of its tracks; None: not known
    readouts  camera: how it is taken to read its picture; intervals: s from one sample to the next
    reported  findings that there are already: a camera whose read-out the motion shows is passed over
    """
    known = {f["text"].split(":")[0] for f in reported if f["code"] == "rolling-shutter"}
    out = []
    for camera, lean in leans.items():
        if not lean or camera not in readouts or camera in known:
            continue
        readout, interval = readouts[camera], intervals[camera]
        # a row's share of the read-out, by px down or across the picture as it is shown
        corner = np.zeros(2)
        step = float(np.sum(readout.share(corner + 1) - readout.share(corner)))
        shown, sd = lean["later"] / step * interval, abs(lean["sd"] / step) * interval
        apart = abs(shown - readout.seconds)
        least = SHOWN.pictures * interval + SHOWN.share * abs(readout.seconds)
        if apart < max(SHOWN.deviations * sd, least) or abs(shown) > SHOWN.longest * interval:
            continue
        ms, about = 1e3 * shown, 1e3 * float(np.hypot(sd, 0.5 * least))
        text = (
            f"{camera}: its rows are read one after the other (rolling shutter): moving targets lean as in "
            f"{ms:.2g} ± {about:.1g} ms from the first row to the last, where {1e3 * readout.seconds:.3g} ms are "
            "assumed: what moves is misplaced by as far as it goes in up to the difference"
        )
        cure = (
            f"Measure it, and set cameras.{camera}.readout_ms: about {ms:.2g}, or motion where cameras see targets in "
            "different rows."
        )
        out.append(Finding("doubtful", "rolling-shutter", text, cure))
    return out

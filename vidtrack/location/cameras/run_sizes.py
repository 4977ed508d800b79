"""What a run's targets look like beside its calibrations' balls: which looks of which cameras may be compared."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.location.cameras.ball_sizes import ball_sizes, timed_looks
from vidtrack.location.cameras.views import View


def run_sizes(
    views: Sequence[View],
    times: Sequence[Array],
    there: tuple[Array, Array, Sequence[str]],
    widths: Mapping[str, Any],
    balls: Mapping[str, Mapping[str, Any]],
    lit: Mapping[str, float],
    lit_otherwise: Collection[str] = (),
) -> dict[str, Any]:
    """`ball_sizes` of the cameras of a run at their corrected times, s.

    there          when (M,) s and where (m, M, 3) the targets of these names are
    widths         camera: how wide its tracks look, at times of its own clock
    balls          camera: columns of its calibration's points; of those only that show the calibration's picture
    lit            camera: 0 where its widths are those of outlines
    lit_otherwise  cameras whose targets are lit otherwise than the balls: nothing is compared
    """
    looks = {
        view.name: timed_looks(None if view.name in lit_otherwise else widths.get(view.name), view.t, np.asarray(t))
        for view, t in zip(views, times, strict=True)
    }
    outlined = {name for name, more in lit.items() if not more}
    return ball_sizes(list(looks), [v.camera for v in views], looks, balls, *there, outlined)

"""The views of a run's cameras: their tables, with balls at their middles where the calibration is one of points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.geometry.picture_part import Window
from vidtrack.location.cameras.ball_middles import (
    SIZE,
    AtMiddles,
    BallSizes,
    ball_sizes_seen,
    larger_than_pixels,
    moved_columns,
    sd_of_flat,
)
from vidtrack.location.cameras.followed import ROWS, rows_of, view_of
from vidtrack.location.cameras.run_pictures import camera_shown
from vidtrack.location.cameras.views import View
from vidtrack.memory import columns_of

if TYPE_CHECKING:
    from pandas import DataFrame


class RunViews(NamedTuple):
    """What `run_views` gives: the views, and what was taken off, of each camera whose table has pixels."""

    views: list[View]
    balls: dict[str, BallSizes]


def run_views(
    centroids: Mapping[str, DataFrame],
    tracklets: Mapping[str, DataFrame],
    cameras: Mapping[str, Any],
    shown: Mapping[str, Window],
    widths: Mapping[str, Any],
    where: str,
    flat: bool = False,
) -> RunViews:
    """The views of all cameras of a run; see `stages.locate.locate` for the tables.

    flat    targets are flat marks: nothing is taken off, and sd_x, sd_y hold how they may be turned
    widths  camera: track: time_s, width (px), how wide tracks look at some samples
    Raises VidtrackError for fewer than two cameras, and for one without a calibration.
    """
    if missing := [name for name in centroids if name not in cameras]:
        raise VidtrackError(
            *(f"{where}: camera {c} has no calibration. Add calibration clips, or remove its video." for c in missing)
        )
    if len(centroids) < 2:
        names = ", ".join(centroids) or "no camera"
        raise VidtrackError(
            f"{where}: mode space needs two cameras or more; there is {names}. Add a camera, or use mode: plane."
        )
    wanted, out = (*ROWS, *SIZE), RunViews([], {})
    for name, table in centroids.items():
        camera, uncertainty = camera_shown(cameras[name][0], cameras[name][1], shown.get(name))
        own = columns_of(table, wanted)
        others = columns_of(tracklets[name], wanted) if name in tracklets else None
        describes, how = _described(cameras[name])
        sized = "pixels" in own and not flat
        if flat:
            larger = larger_than_pixels(own, widths.get(name))
            own, others = sd_of_flat(own, camera, larger), others and sd_of_flat(others, camera, larger)
        elif sized:
            larger, measured, offset = larger_than_pixels(own, widths.get(name)), own, None
            if describes == "points":
                own, offset = moved_columns(own, camera, how, larger)
                others = others and moved_columns(others, camera, how, larger)[0]
            out.balls[name] = ball_sizes_seen(measured, camera, describes, offset)
        view = view_of(name, rows_of(own), rows_of(others) if others else None, camera, uncertainty)
        out.views.append(view._replace(balls=how if sized and describes == "points" else None))
    return out


def _described(calibrated: Any) -> tuple[str, AtMiddles]:
    """What a calibration is one of, `points` or `outlines`, and how far its points are; a bare camera is of points."""
    record = calibrated[2] if len(calibrated) > 2 else {}
    far = (record.get("perspective") or {}).get("distance")
    return str(getattr(calibrated, "describes", "points")), AtMiddles(far)

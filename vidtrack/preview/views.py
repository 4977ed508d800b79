"""Each camera's view from a few pictures of its calibration clips, by the stages that the workflow calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment import Experiment, board_of
from vidtrack.files.tables import read_picks, read_points
from vidtrack.settings.config import Settings
from vidtrack.timing.frame import Frame
from vidtrack.workflow import orders
from vidtrack.workflow.boarded import board_clips
from vidtrack.workflow.own_settings import recording_of
from vidtrack.workflow.waved import wand_cameras

if TYPE_CHECKING:
    from pandas import DataFrame

    from vidtrack.stages.calibrate import Calibration
    from vidtrack.stages.calibration_points import Sightings


class Few(NamedTuple):
    """Some frames of a recording, the size of its pictures and their bits."""

    frames: Sequence[Frame]
    size: tuple[int, int]
    bits: int


class View(NamedTuple):
    """What is known of a camera: its points, then the camera; where one is missing, problems say why.

    later   by what the camera is calibrated that a few pictures do not show: a board, a wand; empty: by its points
    """

    sightings: Sightings | None
    calibration: Calibration | None
    problems: tuple[str, ...]
    later: str = ""


def calibrated_later(settings: Settings, experiment: Experiment, camera: str) -> str:
    """By what a camera is calibrated but for its points, where only the whole recordings show it; empty: by points."""
    waved = wand_cameras(settings, experiment)
    if camera in waved:
        return f"the wand in calibration/{settings.calibration.wand.clip}"  # type: ignore[union-attr]
    clips = board_clips(settings, experiment, camera)
    if clips and orders.lens_of(settings, camera) is None:
        board = board_of(settings, experiment, clips[0])
        assert board is not None, "these are the clips of a board"
        square = f"squares of {board.square:g} {settings.units}"
        shown = ", ".join(f"calibration/{clip}" for clip in clips)
        return f"the {board.type} board in {shown} ({board.columns} x {board.rows}, {square})"
    return ""


def view_of(
    settings: Settings,
    experiment: Experiment,
    camera: str,
    read: Callable[[str, str, Mapping[str, Any]], Few],
    picks: Mapping[str, DataFrame] | None = None,
) -> View:
    """Name the points of a camera and calibrate it.

    read    a function of clip, path and how it is opened that gives some frames
    picks   clip: tag, Xf, Yf of this camera; None: those in the clips' picks.csv
    """
    import pandas as pd

    from vidtrack.exchange.lens import known_lens
    from vidtrack.stages.calibrate import calibrate
    from vidtrack.stages.calibration_points import calibration_points

    order = orders.calibration_points(settings, experiment, camera)
    later = calibrated_later(settings, experiment, camera)
    if later and not order["clips"]:
        return View(None, None, (), later)
    try:
        if experiment.points is None:
            raise VidtrackError("calibration/points.csv: no such file. Write tag,x,y,z for each calibration point.")
        points = read_points(experiment.points, settings.units)
        few = {
            clip: read(clip, experiment.clips[clip].videos[camera], own.get("recording", {}))
            for clip, own in order["clips"].items()
        }
        if picks is None:
            paths = {clip: str(experiment.clips[clip].picks) for clip in order["picks_clips"]}
            picks = {clip: read_picks(path, camera).assign(file=path) for clip, path in paths.items()}
        parts = [table.assign(clip=clip) for clip, table in picks.items() if len(table) and clip in few]
        found = calibration_points(
            {clip: own.frames for clip, own in few.items()},
            points,
            pd.concat(parts, ignore_index=True) if parts else None,
            camera=camera,
            tags={clip: own["tags"] for clip, own in order["clips"].items()},
            detect={clip: own["detect"] for clip, own in order["clips"].items()},
            bits={clip: own.bits for clip, own in few.items()},
            sigma=order["sigma"],
        )
    except VidtrackError as error:
        return View(None, None, error.problems, later)
    if later:
        return View(found, None, (), later)
    size = next(iter(few.values())).size
    try:
        how = {name: value for name, value in orders.calibrate(settings, camera).items() if name != "units"}
        if given := how.pop("lens", None):
            how["lens"] = known_lens(given, orders.lens_file(settings, camera), camera, size)
        done = calibrate(found.table, image_size=size, units=settings.units, search=False, **how)
    except VidtrackError as error:
        return View(found, None, error.problems)
    return View(found, done, ())


def opened_with(settings: Settings, experiment: Experiment, kind: str, name: str, camera: str) -> dict[str, Any]:
    """How the workflow opens the recording of a clip or a run: rate, stream, further files."""
    if kind == "run":
        return dict(orders.track(settings, experiment, name, camera).get("recording", {}))
    return dict(recording_of(settings, experiment.clips[name], camera))

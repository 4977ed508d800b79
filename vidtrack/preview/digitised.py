"""What files of other programs hold that stand in place of recordings."""

from __future__ import annotations

import numpy as np

from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said, in_world
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks
from vidtrack.exchange.tracks.picture_points import needed_size, read_points
from vidtrack.files.experiment import Experiment
from vidtrack.settings.config import Settings
from vidtrack.workflow import import_orders


def points_in_files(settings: Settings, experiment: Experiment, camera: str) -> str:
    """What a camera's files of calibration points hold; VidtrackError where the workflow would refuse one."""
    order = import_orders.import_points(settings, experiment, camera)
    said, where = Convention.of(order["tracks"]), f"cameras.{camera}.tracks"
    needed_size(said, camera)
    read = [read_points(experiment.clips[clip].videos[camera], said, where) for clip in order["clips"]]
    n = sum(len(own.tags) for own in read)
    return f"{n} points that were digitised ({', '.join(dict.fromkeys(own.format for own in read))})"


def camera_in_file(settings: Settings, experiment: Experiment, camera: str) -> str:
    """What the file of a camera that another program calibrated holds; VidtrackError where it would be refused."""
    said = Said.of(import_orders.import_camera(settings, camera))
    given = read_camera(experiment.given[camera], said)
    at = ", ".join(f"{v:.3g}" for v in in_world(given, said).position)
    sigma = import_orders.import_camera(settings, camera).get("sigma_px")
    known = "how well is not known: sigma of positions is NaN" if sigma is None else f"known to {sigma:g} px"
    return f"calibrated by another program ({given.format}); it stands at ({at}); {known}"


def tracks_in_file(settings: Settings, experiment: Experiment, run: str, camera: str) -> str:
    """What a camera's file of tracks holds; VidtrackError where it cannot be read."""
    order = import_orders.import_tracks(settings, experiment, run, camera)
    said, where = Convention.of(order["tracks"]), f"runs.{run}.tracks"
    tracks = read_tracks(experiment.runs[run].videos[camera], said, where)
    n = int(np.isfinite(placed(tracks, said, where)).all(-1).sum())
    return f"tracks of another program ({tracks.format}): {len(tracks.names)} targets, {n} positions"

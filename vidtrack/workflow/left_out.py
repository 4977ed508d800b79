"""Cameras that runs are located without: their calibration or their recording failed, and two others are left."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

from vidtrack.files.experiment import Experiment
from vidtrack.files.records import read_json
from vidtrack.settings.config import Settings

VARIABLE = "VIDTRACK_WITHOUT"
"""The variable of the environment that hands the answer of `also_left_out` to another call of Snakemake, as JSON."""

OF_A_CALIBRATION = ("calibration_points", "calibrate", "import_points", "import_camera")
"""Rules that calibrate one camera; it is their last part."""

OF_A_RECORDING = ("track", "import_tracks")
"""Rules that measure one recording; their parts are the run and the camera."""

FEWEST = 2
"""Cameras by which a run is located, at least."""


class LeftOut(NamedTuple):
    """What is left out, and the record of the failure that is the reason (a path)."""

    calibration: Mapping[str, str]  # by camera: it has no part in any run
    recordings: Mapping[str, Mapping[str, str]]  # by run and camera

    def of_run(self, run: str) -> dict[str, str]:
        """The cameras that a run is located without; each with what failed, in words."""
        recordings = dict.fromkeys(self.recordings.get(run, ()), "its recording could not be measured")
        return recordings | dict.fromkeys(self.calibration, "its calibration failed")

    @property
    def records(self) -> list[str]:
        """The paths of the records of the failures."""
        return [*self.calibration.values(), *(path for own in self.recordings.values() for path in own.values())]


NOTHING = LeftOut({}, {})


def from_environment(variables: Mapping[str, str]) -> LeftOut:
    """What this call of Snakemake leaves out."""
    return LeftOut(*json.loads(variables[VARIABLE])) if variables.get(VARIABLE) else NOTHING


def to_environment(left: LeftOut) -> dict[str, str]:
    """The environment of a call of Snakemake that leaves this out."""
    return {**os.environ, VARIABLE: json.dumps(left)}


def also_left_out(settings: Settings, experiment: Experiment, left: LeftOut, failed: Iterable[str]) -> LeftOut:
    """What can be left out so that runs are located all the same; `left` itself where nothing more can be.

    experiment  as it was found, with all its cameras
    failed      the paths of the records of failures
    A camera's calibration is left out only where no run needs it: runs in a plane, and those that two cameras filmed,
    do.
    """
    for path in failed:
        record = read_json(path)
        rule, parts = record["rule"], record["parts"]
        if rule in OF_A_CALIBRATION and parts[0] != "calibration_after":
            camera, runs = parts[-1], [name for name, run in experiment.runs.items() if parts[-1] in run.videos]
            more = left._replace(calibration={**left.calibration, camera: path})
        elif rule in OF_A_RECORDING:
            run, camera = parts
            runs = [run]
            more = left._replace(recordings={**left.recordings, run: {**left.recordings.get(run, {}), camera: path}})
        else:
            continue
        if runs and all(_is_located(settings, experiment, run, more) for run in runs):
            left = more
    return left


def without(experiment: Experiment, left: LeftOut) -> Experiment:
    """The experiment as if those cameras had not filmed."""
    clips = {
        name: replace(clip, videos={c: path for c, path in clip.videos.items() if c not in left.calibration})
        for name, clip in experiment.clips.items()
    }
    runs = {
        name: replace(run, videos={c: path for c, path in run.videos.items() if c not in left.of_run(name)})
        for name, run in experiment.runs.items()
    }
    given = {camera: path for camera, path in experiment.given.items() if camera not in left.calibration}
    return replace(experiment, clips={n: c for n, c in clips.items() if c.videos}, runs=runs, given=given)


def _is_located(settings: Settings, experiment: Experiment, run: str, left: LeftOut) -> bool:
    mode = settings.runs[run].mode if run in settings.runs else "space"
    return mode == "space" and len(set(experiment.runs[run].videos) - set(left.of_run(run))) >= FEWEST

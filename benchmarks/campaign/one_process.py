"""An experiment folder processed in this process, job by job, as the workflow would: 1 to 3 s instead of 30."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment import Experiment
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import Settings, settings_from_config
from vidtrack.workflow import orders, report_orders
from vidtrack.workflow.failure import write_failure
from vidtrack.workflow.job import Job
from vidtrack.workflow.provenance import place

Paths = str | Sequence[str]


class Outcome(NamedTuple):
    """What became of an experiment: refused before any job (its lines), or verdict.json; lines of jobs that failed."""

    refused: list[str]
    verdict: Mapping[str, Any]
    failed: list[str]


def process(folder: Path) -> Outcome:
    """Run every job that the verdict reads; a job that fails costs those that need its results, and no others."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        settings = settings_from_config(yaml.safe_load(Path("config.yaml").read_text()))
        experiment = checked_experiment(settings)
        return _Jobs(settings, experiment).all()
    except VidtrackError as error:
        return Outcome(list(error.problems), {}, [])
    finally:
        os.chdir(before)


class _Jobs:
    def __init__(self, settings: Settings, experiment: Experiment) -> None:
        self.settings, self.experiment = settings, experiment
        self.results = experiment.results
        self.made: list[str] = []
        self.failures: list[str] = []
        self.lines: list[str] = []

    def all(self) -> Outcome:
        self._calibration()
        for run in self.experiment.runs:
            self._run(run)
        verdict = f"{self.results}/verdict.json"
        kinds = (".json", "points.parquet", "trajectories.parquet")
        read = [p for p in self.made if p.endswith(kinds) and "alone.json" not in p]
        order = report_orders.verdict(self.settings, self.experiment)
        self._do("verdict", order, {"results": [*read, *self.failures]}, {"verdict": verdict})
        record = yaml.safe_load(Path(verdict).read_text()) if os.path.isfile(verdict) else {}
        return Outcome([], record, self.lines)

    def _do(
        self, rule: str, order: Mapping[str, Any], inputs: Mapping[str, Paths], outputs: Mapping[str, str], *parts: str
    ) -> None:
        """One job, where all that it needs was made."""
        wanted = [p for v in inputs.values() for p in ([v] if isinstance(v, str) else v)]
        if any(p.startswith(f"{self.results}/") and p not in (*self.made, *self.failures) for p in wanted):
            return
        given = {name: value if isinstance(value, str) else list(value) for name, value in inputs.items() if value}
        provenance = {"vidtrack": "campaign", "settings": dict(order)}
        try:
            with contextlib.redirect_stderr(io.StringIO()):
                importlib.import_module(f"vidtrack.jobs.{rule}").run(Job(dict(order), given, dict(outputs), provenance))
        except VidtrackError as error:
            problems = list(error.problems)
        except Exception as error:
            problems = [f"traceback: {rule}: {type(error).__name__}: {error}"]
        else:
            self.made += outputs.values()
            return
        self.lines += problems
        self.failures.append(write_failure(place(self.results, rule, *parts), rule, problems))

    def _calibration(self) -> None:
        settings, experiment = self.settings, self.experiment
        needed = orders.calibrated(settings, experiment)
        bundled = settings.calibration.refine == "bundle"
        folder = f"{self.results}/calibration"
        for camera in experiment.cameras_in_clips():
            clips = [experiment.clips[c] for c in orders.clips_of(settings, experiment, camera)]
            self._do(
                "calibration_points",
                orders.calibration_points(settings, experiment, camera),
                {
                    "points": experiment.points or [],
                    "videos": [clip.videos[camera] for clip in clips],
                    "picks": [clip.picks for clip in clips if clip.picks],
                },
                {
                    "sightings": f"{folder}/{camera}/sightings.parquet",
                    "picture": f"{folder}/{camera}/picture.png",
                    "background": f"{folder}/{camera}/background.png",
                    "record": f"{folder}/{camera}/labelling.json",
                },
                "calibration",
                camera,
            )
        judged = f"{folder}/survey.json"
        if len(needed) > 1:
            self._do(
                "survey",
                orders.survey(settings, needed),
                {
                    "sightings": [f"{folder}/{c}/sightings.parquet" for c in needed],
                    "pictures": [f"{folder}/{c}/picture.png" for c in needed],
                },
                {"record": judged},
                "calibration",
            )
        for camera in needed:
            self._do(
                "calibrate",
                orders.calibrate(settings, camera),
                {
                    "survey": judged if len(needed) > 1 else [],
                    "sightings": f"{folder}/{camera}/sightings.parquet",
                    "labelling": f"{folder}/{camera}/labelling.json",
                    "picture": f"{folder}/{camera}/picture.png",
                },
                {
                    "points": f"{folder}/{camera}/points.parquet",
                    "camera": f"{folder}/{camera}/{'alone' if bundled else 'camera'}.json",
                    "search": f"{folder}/{camera}/search.parquet",
                },
                "calibration",
                camera,
            )
        if needed:
            self._do(
                "back_project",
                orders.back_project(settings, needed),
                {
                    "cameras": [f"{folder}/{c}/camera.json" for c in needed],
                    "points": [f"{folder}/{c}/points.parquet" for c in needed],
                },
                {"table": f"{folder}/backprojection.parquet", "record": f"{folder}/backprojection.json"},
            )

    def _run(self, name: str) -> None:
        settings, experiment = self.settings, self.experiment
        run, folder, calibration = experiment.runs[name], f"{self.results}/runs/{name}", f"{self.results}/calibration"
        for camera, video in run.videos.items():
            self._do(
                "track",
                orders.track(settings, experiment, name, camera),
                {"video": video, "targets": run.targets or []},
                {
                    "centroids": f"{folder}/centroids/{camera}.parquet",
                    "record": f"{folder}/centroids/{camera}.json",
                    "tracklets": f"{folder}/tracklets/{camera}.parquet",
                    "windows": f"{folder}/windows/{camera}.parquet",
                    "light": f"{folder}/light/{camera}.parquet",
                    "background": f"{folder}/background/{camera}.parquet",
                    "picture": f"{folder}/background/{camera}.png",
                },
                name,
                camera,
            )
        cameras = list(run.videos)
        readings = [f"{folder}/centroids/{c}.json" for c in cameras]
        clocks = orders.clocks(settings, experiment, name)
        if clocks["sought"]:
            light = [f"{folder}/light/{c}.parquet" for c in cameras]
            inputs = {"videos": list(run.videos.values()), "light": light, "readings": readings}
            self._do("clocks", clocks, inputs, {"record": f"{folder}/clocks.json"}, name)
        own = settings.runs.get(name)
        in_plane = own is not None and own.mode == "plane"
        of_clips = bool(own and own.plane and own.plane.points) if in_plane else True

        def of_each(file: str, used: bool) -> list[str]:
            return [f"{calibration}/{c}/{file}" for c in cameras] if used else []

        calibration_files = {
            "cameras": of_each("camera.json", not in_plane),
            "points": of_each("points.parquet", not in_plane),
            "labelling": of_each("labelling.json", of_clips),
        }
        sightings = of_each("sightings.parquet", of_clips)
        self._do(
            "steadiness",
            orders.steadiness(settings, experiment, name),
            {
                "backgrounds": [f"{folder}/background/{c}.parquet" for c in cameras],
                "pictures": [f"{folder}/background/{c}.png" for c in cameras],
                "readings": readings,
                **calibration_files,
                "sightings": sightings,
                "calibrated": of_each("background.png", of_clips),
            },
            {"table": f"{folder}/steadiness.parquet", "record": f"{folder}/steadiness.json"},
            name,
        )
        self._do(
            "locate",
            orders.locate(settings, experiment, name),
            {
                "centroids": [f"{folder}/centroids/{c}.parquet" for c in cameras],
                "readings": readings,
                "tracklets": [f"{folder}/tracklets/{c}.parquet" for c in cameras],
                "windows": [f"{folder}/windows/{c}.parquet" for c in cameras],
                **calibration_files,
                "sightings": sightings if in_plane else [],
                "steadiness": f"{folder}/steadiness.parquet" if settings.calibration.follow else [],
                "clocks": f"{folder}/clocks.json" if clocks["sought"] else [],
            },
            {
                "trajectories": f"{folder}/trajectories.parquet",
                "csv": f"{folder}/trajectories.csv",
                "associations": f"{folder}/associations.parquet",
                "record": f"{folder}/locate.json",
            },
            name,
        )
        self._do(
            "kinematics",
            orders.kinematics(settings),
            {"trajectories": f"{folder}/trajectories.parquet"},
            {"kinematics": f"{folder}/kinematics.parquet", "record": f"{folder}/kinematics.json"},
            name,
        )
        if run.reference:
            self._do(
                "compare",
                orders.compare(settings, experiment, name),
                {"trajectories": f"{folder}/trajectories.parquet", "reference": run.reference},
                {"comparison": f"{folder}/comparison.json", "series": f"{folder}/comparison.parquet"},
                name,
            )

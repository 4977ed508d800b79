"""What the stages made of an experiment, as the verdict and the report read it: records and tables, by camera and run.

Whatever is not there (a run of mode plane has no calibration, a run that failed has no trajectories) is None or empty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pandas import DataFrame

Record = Mapping[str, Any]


@dataclass
class CameraResults:
    """One camera's calibration: camera.json, labelling.json, points.parquet, search.parquet, paths of pictures."""

    record: Record | None = None
    labelling: Record | None = None
    points: DataFrame | None = None
    search: DataFrame | None = None
    overlay: str | None = None
    picture: str | None = None


@dataclass
class RunResults:
    """One run.

    readings, centroids   by camera: centroids/<camera>.json and .parquet
    records               by name: locate, clocks, kinematics, bodies, comparison, waterline
    tables                by name: trajectories, kinematics, bodies, comparison, waterline
    timestacks            by transect, of waterline.npz
    pictures              by camera: the path of the picture with which its recording begins
    posters               by camera: the path of the poster of its overlay film
    """

    readings: dict[str, Record] = field(default_factory=dict)
    centroids: dict[str, DataFrame] = field(default_factory=dict)
    records: dict[str, Record] = field(default_factory=dict)
    tables: dict[str, DataFrame] = field(default_factory=dict)
    timestacks: dict[str, Any] = field(default_factory=dict)
    pictures: dict[str, str] = field(default_factory=dict)
    posters: dict[str, str] = field(default_factory=dict)

    def record(self, name: str) -> Record:
        """The record of that name, empty where there is none."""
        return self.records.get(name, {})


@dataclass
class Results:
    """The whole experiment.

    cameras, after   by camera: the calibration, and that from the clips filmed after the test
    wand             wand.json; by_body: self.json, how a body refined the cameras
    survey           survey.json; survey_after: that of the clips filmed after the test
    back, back_table   backprojection.json and .parquet; stability: stability.json; verdict: verdict.json
    runs             by name
    summaries        of runs, `report/run_<run>.json`; calibration_page, campaign_page: whether there is one
    failures         of jobs that failed: {rule, parts: run and camera, or clip set and camera; findings}
    """

    cameras: dict[str, CameraResults] = field(default_factory=dict)
    after: dict[str, CameraResults] = field(default_factory=dict)
    wand: Record | None = None
    by_body: Record | None = None
    survey: Record | None = None
    survey_after: Record | None = None
    back: Record | None = None
    back_table: DataFrame | None = None
    stability: Record | None = None
    verdict: Record | None = None
    runs: dict[str, RunResults] = field(default_factory=dict)
    summaries: dict[str, Record] = field(default_factory=dict)
    calibration_page: bool = False
    campaign_page: bool = False
    failures: list[Record] = field(default_factory=list)

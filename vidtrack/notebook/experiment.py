"""An experiment's results for notebooks and scripts; a file is read when it is first asked for.

    import vidtrack
    lab = vidtrack.load("my-lab")

    lab["pluck"].trajectories            a table: time_s, target, x, y, z, ...; units in .attrs["units"]
    lab["pluck"].to_xarray()             the whole run, variables with `units` that pint reads
    lab.cameras["cam1"].project([[0, 0, 0]])

What was read is kept: after another `vidtrack run`, load again.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from vidtrack.errors import VidtrackError
from vidtrack.naming import hint_of
from vidtrack.notebook.camera import CalibratedCamera
from vidtrack.notebook.run import LoadedRun

if TYPE_CHECKING:
    from pandas import DataFrame

Thing = TypeVar("Thing")


class Lazy(Mapping[str, Thing], Generic[Thing]):
    """Things by name, each made when it is first asked for.

    KeyError, with the names that there are, for another one.
    """

    def __init__(self, kind: str, names: list[str], make: Callable[[str], Thing]) -> None:
        self._kind, self._names, self._make = kind, names, make
        self._made: dict[str, Thing] = {}

    def __getitem__(self, name: str) -> Thing:
        if name not in self._names:
            hint = hint_of(name, self._names, f"there are {', '.join(self._names) or 'none'}.")
            raise KeyError(f"no {self._kind} {name!r}; {hint}")
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __repr__(self) -> str:
        return f"{self._kind}s: {', '.join(self._names) or 'none'}"


class LoadedExperiment:
    """The results of an experiment.

    folder    as given; results: the folder that holds them
    units     the unit of every length
    runs      name: LoadedRun, of each run that has trajectories; `lab["pluck"]` is `lab.runs["pluck"]`
    cameras   name: CalibratedCamera
    """

    def __init__(
        self, folder: str, results: str, units: str, axes: Mapping[str, Mapping[str, str]], refined: bool = False
    ) -> None:
        self._refined = refined
        self.folder, self.results, self.units = folder, results, units
        self.runs: Mapping[str, LoadedRun] = Lazy("run", _folders(results, "runs", "trajectories.parquet"), self._run)
        self.cameras: Mapping[str, CalibratedCamera] = Lazy(
            "camera", _folders(results, "calibration", "camera.json"), self._camera
        )
        self._axes = axes

    def __getitem__(self, run: str) -> LoadedRun:
        return self.runs[run]

    def __iter__(self) -> Iterator[str]:
        return iter(self.runs)

    def __len__(self) -> int:
        return len(self.runs)

    def __repr__(self) -> str:
        return f"<vidtrack experiment {self.folder}: {self.runs!r}; {self.cameras!r}; lengths in {self.units}>"

    @cached_property
    def verdict(self) -> dict[str, Any]:
        """verdict.json: good, doubtful, bad or failed, with reasons, of the calibration and of each run."""
        from vidtrack.files.records import read_json

        path = os.path.join(self.results, "verdict.json")
        if not os.path.isfile(path):
            raise VidtrackError(f"{path}: not there yet. Call vidtrack run {self.folder} first.")
        return read_json(path)

    @cached_property
    def trajectories(self) -> DataFrame:
        """The trajectories of all runs as one table, with a column `run` before the others."""
        import pandas as pd

        tables = []
        for name, run in self.runs.items():
            table = run.trajectories.copy()
            table.insert(0, "run", name)
            tables.append(table)
        whole = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()
        whole.attrs["units"] = {"run": "", **tables[0].attrs["units"]} if tables else {}
        return whole

    def _run(self, name: str) -> LoadedRun:
        return LoadedRun(name, os.path.join(self.results, "runs", name), self.units, self._axes.get(name))

    def _camera(self, name: str) -> CalibratedCamera:
        from vidtrack.files.camera_json import located_by

        return CalibratedCamera(located_by(os.path.join(self.results, "calibration", name), self._refined))


def load(folder: str | os.PathLike[str]) -> LoadedExperiment:
    """The results in an experiment's folder: the one that holds config.yaml, or one that holds results/ alone.

    Nothing but config.yaml is read. VidtrackError, one line, where there are no results.
    """
    from vidtrack.files.config_file import read_config
    from vidtrack.settings.config import settings_from_config

    folder = os.fspath(folder)
    if not os.path.isdir(folder):
        raise VidtrackError(f"{folder}: no such folder. Correct the name.")
    config = os.path.join(folder, "config.yaml")
    if not os.path.isfile(config):
        results = os.path.join(folder, "results")
        return LoadedExperiment(folder, _checked(results, folder), _units(results), {})
    settings = settings_from_config(read_config(config), config)
    results = os.path.normpath(os.path.join(folder, settings.experiment, "results"))
    axes = {}
    for name in _folders(_checked(results, folder), "runs", "trajectories.parquet"):
        own = settings.runs.get(name)
        if found := (own.axes if own else None) or settings.axes:
            axes[name] = found.model_dump()
    return LoadedExperiment(folder, results, settings.units, axes, settings.calibration.self_calibration is not None)


def _checked(results: str, folder: str) -> str:
    if not os.path.isdir(results):
        raise VidtrackError(f"{results}: not there yet. Call vidtrack run {folder} first.")
    return results


def _folders(results: str, part: str, holds: str) -> list[str]:
    """The folders in a part of the results that hold a file, in the order of their names."""
    here = os.path.join(results, part)
    names = sorted(os.listdir(here)) if os.path.isdir(here) else []
    return [name for name in names if os.path.isfile(os.path.join(here, name, holds))]


def _units(results: str) -> str:
    """The unit of length that a result states, where there is no config.yaml."""
    from vidtrack.files.tables import read_units

    for name in _folders(results, "runs", "trajectories.parquet"):
        return str(read_units(os.path.join(results, "runs", name, "trajectories.parquet")).get("x", ""))
    return ""

"""One run's results as tables and as an xarray Dataset; each file is read when it is first asked for."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any
from warnings import warn

from vidtrack.errors import VidtrackError

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset


class LoadedRun:
    """The results of a run.

    name, folder, units; axes: {waves, up} where the config says them
    Tables are tidy: a row a sample and target (or body); `.attrs["units"]` has the unit of each column.
    """

    def __init__(self, name: str, folder: str, units: str, axes: Mapping[str, str] | None = None) -> None:
        self.name, self.folder, self.units, self.axes = name, folder, units, axes

    def __repr__(self) -> str:
        return f"<vidtrack run {self.name}: {', '.join(self.tables)}>"

    @cached_property
    def tables(self) -> list[str]:
        """The names of the tables that there are, centroids/<camera> among them."""
        found = []
        for part in ("", "centroids"):
            here = os.path.join(self.folder, part)
            for name in sorted(os.listdir(here)) if os.path.isdir(here) else []:
                if name.endswith(".parquet"):
                    found.append(f"{part}/{name}".lstrip("/").removesuffix(".parquet"))
        return found

    def table(self, name: str) -> DataFrame:
        """A table by its name: trajectories, kinematics, bodies, motions, comparison, centroids/cam1, ...

        A warning where it is of an earlier call (OUTDATED.txt lies beside it).
        """
        if name not in self._read:
            from vidtrack.files.outdated_note import is_outdated
            from vidtrack.files.tables import read_parquet, read_units

            if name not in self.tables:
                raise VidtrackError(
                    f"run {self.name}: no table {name!r}; there are {', '.join(self.tables) or 'none'}."
                )
            path = os.path.join(self.folder, f"{name}.parquet")
            if is_outdated(path):
                warn(
                    f"{path}: of an earlier call, not of the present settings and inputs. Do not use it.", stacklevel=2
                )
            table = read_parquet(path)
            table.attrs["units"] = read_units(path)
            self._read[name] = table
        return self._read[name]

    @cached_property
    def _read(self) -> dict[str, DataFrame]:
        return {}

    @property
    def trajectories(self) -> DataFrame:
        """time_s, timecode, target, x, y, z, sigma_x, ..., miss, n_cameras, flag."""
        return self.table("trajectories")

    @property
    def kinematics(self) -> DataFrame:
        """Smoothed positions, velocities and accelerations, with their sigmas."""
        return self.table("kinematics")

    @property
    def bodies(self) -> DataFrame:
        """Six degrees of freedom of each body."""
        return self.table("bodies")

    @property
    def motions(self) -> DataFrame:
        """Surge, sway, heave, roll, pitch, yaw of named points."""
        return self.table("motions")

    def record(self, name: str) -> dict[str, Any]:
        """A JSON record by its name: locate, comparison, analysis, ..."""
        from vidtrack.files.records import read_json

        path = os.path.join(self.folder, f"{name}.json")
        if not os.path.isfile(path):
            raise VidtrackError(f"{path}: no such record of run {self.name}.")
        return read_json(path)

    def to_xarray(self) -> Dataset:
        """The run as a Dataset over time: position(time, space, keypoint, individual), velocity, body_position, ...

        Each variable has `units` in words that pint reads; `exchange.dataset` has the conventions.
        """
        from vidtrack.exchange.dataset import dataset
        from vidtrack.exchange.results import read_run

        names = [name for name in ("trajectories", "kinematics", "bodies", "motions") if name in self.tables]
        paths: dict[str, list[str]] = {name: [os.path.join(self.folder, f"{name}.parquet")] for name in names}
        flat = not self.trajectories["z"].notna().any() and self._mode() == "plane"
        return dataset(read_run(paths, self.name, self.units, self.axes, "plane" if flat else "space"))

    @cached_property
    def xarray(self) -> Dataset:
        """As `to_xarray`, read once."""
        return self.to_xarray()

    def _mode(self) -> str:
        path = os.path.join(self.folder, "locate.json")
        return str(self.record("locate").get("mode", "space")) if os.path.isfile(path) else "space"

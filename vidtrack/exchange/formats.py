"""The formats that vidtrack writes: their names, the files that each makes, and what of the results it needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from vidtrack.exchange import (
    anipose,
    c3d,
    colmap,
    dltdv,
    matlab,
    metashape,
    netcdf,
    opencv_yaml,
    openfast,
    openptv,
    opensim,
    plain,
    qtm,
)
from vidtrack.exchange.measured import Run, Written
from vidtrack.exchange.plain import EXPORTED
from vidtrack.exchange.thesis import results as thesis

DIGITISED = ("trajectories", "associations", "centroids", "tracklets", "cameras", "locate")
"""The results in which it stands where each camera saw each target."""


class Layout(NamedTuple):
    """What decides which files a format makes: known before anything is measured.

    analysed   whether there is motions.parquet
    """

    name: str
    mode: str = "space"
    cameras: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()
    analysed: bool = False


class Format(NamedTuple):
    """One format.

    write    from a run's results to the files
    files    the names of its files, of a layout
    reads    of each run: trajectories, kinematics, bodies, motions (those that there are), associations,
             centroids, tracklets, locate, cameras, points
    wants    what a run must have: space (positions with z), bodies, pair (two cameras)
    """

    write: Callable[[Run], Written]
    files: Callable[[Layout], list[str]]
    reads: tuple[str, ...] = ("trajectories",)
    wants: tuple[str, ...] = ("space",)

    def suits(self, layout: Layout) -> bool:
        """Whether a run has what the format needs."""
        return not self.lacking(layout)

    def lacking(self, layout: Layout) -> str:
        """What the format needs and the run does not have, as a clause; empty where it has all."""
        if layout.mode == "waterline":
            return "it has no targets (mode waterline)"
        if "space" in self.wants and layout.mode != "space":
            return f"its positions have no z (mode {layout.mode})"
        if "bodies" in self.wants and not layout.bodies:
            return "the config names no bodies for it"
        if "pair" in self.wants and len(layout.cameras) != 2:
            return f"it has {len(layout.cameras)} cameras, and the format two"
        return ""


def _named(*endings: str) -> Callable[[Layout], list[str]]:
    return lambda layout: [layout.name + ending for ending in endings]


def _of_cameras(*endings: str) -> Callable[[Layout], list[str]]:
    return lambda layout: [camera + ending for camera in layout.cameras for ending in endings]


def _always(*names: str) -> Callable[[Layout], list[str]]:
    return lambda layout: list(names)


def _tables(ending: str) -> Callable[[Layout], list[str]]:
    def files(layout: Layout) -> list[str]:
        there = {"bodies": bool(layout.bodies), "motions": layout.analysed}
        names = [name for name in EXPORTED if there.get(name, True)]
        return [f"{layout.name}_{name}{ending}" for name in names] + [f"{layout.name}_units.json"]

    return files


def _qtm(layout: Layout) -> list[str]:
    return _named(*(["_6D.tsv"] if layout.bodies else []), "_3D.tsv", "_qtm.mat")(layout)


def _lenses(write: Callable[[Run], Written], files: Callable[[Layout], list[str]]) -> Format:
    return Format(write, files, ("cameras", "locate"))


def _digitised(write: Callable[[Run], Written], joint: str, *more: str) -> Format:
    names = ("xypts", "undistorted_xypts", "xyzpts", "xyzres", "offsets", "dltcoefs")
    return Format(write, _named(*(f"{joint}{name}.csv" for name in names), *more), DIGITISED)


FORMATS: dict[str, Format] = {
    "csv": Format(plain.write_csv, _tables(".csv"), EXPORTED, ()),
    "parquet": Format(plain.write_parquet, _tables(".parquet"), EXPORTED, ()),
    "c3d": Format(c3d.write, _named(".c3d")),
    "netcdf": Format(netcdf.write, _named(".nc"), EXPORTED, ()),
    "cf": Format(netcdf.write_cf, _named("_cf.nc"), EXPORTED, ()),
    "mat": Format(matlab.write, _named(".mat"), EXPORTED, ()),
    "qtm": Format(qtm.write, _qtm, ("trajectories", "bodies")),
    "openfast": Format(openfast.write_openfast, _named(".out"), ("bodies", "motions"), ("space", "bodies")),
    "wecsim": Format(openfast.write_wecsim, _named("_wecsim.mat"), ("bodies", "motions"), ("space", "bodies")),
    "trc": Format(opensim.write_trc, _named(".trc")),
    "mot": Format(opensim.write_mot, _named(".mot"), ("bodies",), ("space", "bodies")),
    "dltdv8": _digitised(dltdv.write_dltdv8, "_"),
    "dltdv7": _digitised(dltdv.write_dltdv7, "_"),
    "argus": _digitised(dltdv.write_argus, "-", "-camera-profile.txt"),
    "opencv": _lenses(opencv_yaml.write, _of_cameras(".yml")),
    "anipose": _lenses(anipose.write, _always("calibration.toml")),
    "openptv": _lenses(openptv.write, _of_cameras(".tif.ori", ".tif.addpar", ".json")),
    "colmap": _lenses(colmap.write, _always("cameras.txt", "images.txt", "points3D.txt")),
    "metashape": _lenses(metashape.write, _always("cameras.xml")),
    "thesis": Format(thesis.write, _always(*thesis.FILES), (*DIGITISED, "points"), ("space", "pair")),
}


def places(name: str, layout: Layout) -> list[str]:
    """Where a format's files lie inside of `export`: in a folder of their own unless it is one, named as the run."""
    files = FORMATS[name].files(layout)
    alone = len(files) == 1 and files[0].startswith(layout.name)
    return files if alone else [f"{name}/{file}" for file in files]


def written(name: str, run: Run) -> Written:
    """The files of a run in a format; VidtrackError where it cannot hold them."""
    return FORMATS[name].write(run)

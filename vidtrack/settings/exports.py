"""`export`: the formats of other programs in which results are wanted too."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

FormatName = Literal[
    "csv",
    "parquet",
    "netcdf",
    "cf",
    "mat",
    "c3d",
    "qtm",
    "trc",
    "mot",
    "openfast",
    "wecsim",
    "dltdv8",
    "dltdv7",
    "argus",
    "opencv",
    "anipose",
    "openptv",
    "colmap",
    "metashape",
    "thesis",
]
"""As `exchange.formats.FORMATS` has them; a test compares the two."""

ABOUT: dict[FormatName, str] = {
    "csv": "vidtrack's tables as CSV",
    "parquet": "vidtrack's tables as Parquet",
    "c3d": "points over time",
    "netcdf": "NetCDF for xarray and movement, time a number",
    "cf": "NetCDF with the time that the CF conventions ask for",
    "mat": "a struct for MATLAB",
    "qtm": "bodies and markers as Qualisys exports them, TSV and MATLAB",
    "openfast": "motions of bodies as PtfmSurge ... PtfmYaw",
    "wecsim": "motions of bodies as WEC-Sim's output.bodies",
    "dltdv8": "digitised points and DLT coefficients, pixels from the upper left",
    "dltdv7": "the same for DLTdv 5 to 7, pixels from the lower left",
    "argus": "the same for Argus, and its camera profile",
    "opencv": "cameras as OpenCV's YAML",
    "anipose": "cameras as calibration.toml",
    "openptv": "cameras as .ori and .addpar",
    "colmap": "cameras as cameras.txt and images.txt",
    "metashape": "cameras as cameras.xml",
    "trc": "markers for OpenSim",
    "mot": "motions of bodies for OpenSim",
    "thesis": "two cameras as camparm.dat, cam1.prn, outcam1.prn, cam1vid.prn, location.prn and so on",
}
"""What each format is, in a few words."""

DESCRIPTION = "; ".join(f"{name}: {about}" for name, about in ABOUT.items())

OTHER_NAMES = {
    "matlab": "mat",
    "nc": "netcdf",
    "xarray": "netcdf",
    "movement": "netcdf",
    "opensim": "trc",
    "dltdv": "dltdv8",
    "qualisys": "qtm",
    "agisoft": "metashape",
}
"""What people also call a format."""


def known_name(name: str) -> str:
    """A format's own name: capitals, hyphens, underscores and spaces count for nothing (WEC-Sim, DLTdv 8)."""
    plain = "".join(letter for letter in name.lower() if letter not in "-_ ")
    return OTHER_NAMES.get(plain, plain)


def formats(value: Any) -> Any:
    """One format, or a list of formats, each once; by their other names too."""
    if isinstance(value, str):
        value = (value,)
    if not isinstance(value, (list, tuple)):
        return value
    return tuple(dict.fromkeys(known_name(str(v)) for v in value))


Formats = Annotated[tuple[FormatName, ...], BeforeValidator(formats)]

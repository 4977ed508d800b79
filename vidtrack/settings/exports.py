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
}
"""What each format is, in a few words."""

DESCRIPTION = "; ".join(f"{name}: {about}" for name, about in ABOUT.items())

OTHER_NAMES = {
    "matlab": "mat",
    "nc": "netcdf",
    "movement": "netcdf",
    "opensim": "trc",
    "dltdv": "dltdv8",
    "qualisys": "qtm",
}
"""What people also call a format."""


def formats(value: Any) -> Any:
    """One format, or a list of formats, each once; by their other names too."""
    if isinstance(value, str):
        value = (value,)
    if not isinstance(value, (list, tuple)):
        return value
    known = (str(v).lower() for v in value)
    return tuple(dict.fromkeys(OTHER_NAMES.get(name, name) for name in known))


Formats = Annotated[tuple[FormatName, ...], BeforeValidator(formats)]

"""NetCDF: the Dataset of `exchange.dataset`, whose docstring has the conventions, as one file.

NetCDF 3 with 64-bit offsets: xarray, netCDF4, MATLAB, R and movement read it without any further library. Read it with
`xarray.open_dataset`; names of targets are UTF-8. A variable of more than 4 GB does not fit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vidtrack.errors import VidtrackError
from vidtrack.exchange.dataset import dataset
from vidtrack.exchange.measured import Run, Written

if TYPE_CHECKING:
    from xarray import Dataset

MOST_BYTES = 2**32 - 4
"""Of one variable in NetCDF 3 with 64-bit offsets."""


DAY = "1970-01-01 00:00:00"
"""What stands for the day, which is not known, where CF asks for one."""


def write(run: Run) -> Written:
    """All tables of a run as one NetCDF file; VidtrackError for a run without a sample."""
    own = dataset(run)
    notes = [str(own.attrs["comment"])] if "comment" in own.attrs else []
    return Written({f"{run.name}.nc": _content(own, run)}, notes)


def write_cf(run: Run) -> Written:
    """The same, with the time that CF asks for: seconds since midnight of a day, which here stands for any.

    xarray makes dates of it; movement, which takes numbers, wants the other one.
    """
    own = dataset(run)
    about = {"units": f"seconds since {DAY}", "standard_name": "time", "axis": "T", "calendar": "standard"}
    own["time"].attrs |= about | {"comment": "the day is not known: 1970-01-01 stands for it"}
    return Written({f"{run.name}_cf.nc": _content(own, run)}, ["the day is not known: 1970-01-01 stands for it"])


def _content(own: Dataset, run: Run) -> bytes:
    if (largest := max(v.nbytes for v in own.variables.values())) > MOST_BYTES:
        raise VidtrackError(f"run {run.name}: a table of {largest} bytes; NetCDF 3 holds {MOST_BYTES}. Export parquet.")
    encoding = {str(name): {"_FillValue": None} for name in own.coords}
    return bytes(own.to_netcdf(engine="scipy", format="NETCDF3_64BIT", encoding=encoding))

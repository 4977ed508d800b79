"""NetCDF: the Dataset of `exchange.dataset`, whose docstring has the conventions, as one file.

NetCDF 3 with 64-bit offsets: xarray, netCDF4, MATLAB, R and movement read it without any further library. Read it with
`xarray.open_dataset`; names of targets are UTF-8. A variable of more than 4 GB does not fit.
"""

from __future__ import annotations

from vidtrack.errors import VidtrackError
from vidtrack.exchange.dataset import dataset
from vidtrack.exchange.measured import Run, Written

MOST_BYTES = 2**32 - 4
"""Of one variable in NetCDF 3 with 64-bit offsets."""


def write(run: Run) -> Written:
    """All tables of a run as one NetCDF file; VidtrackError for a run without a sample."""
    own = dataset(run)
    if (largest := max(v.nbytes for v in own.variables.values())) > MOST_BYTES:
        raise VidtrackError(f"run {run.name}: a table of {largest} bytes; NetCDF 3 holds {MOST_BYTES}. Export parquet.")
    encoding = {str(name): {"_FillValue": None} for name in own.coords}
    content = own.to_netcdf(engine="scipy", format="NETCDF3_64BIT", encoding=encoding)
    notes = [str(own.attrs["comment"])] if "comment" in own.attrs else []
    return Written({f"{run.name}.nc": bytes(content)}, notes)

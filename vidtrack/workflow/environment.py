"""The environment of the jobs: the interpreter and the package are those of Snakemake itself."""

from __future__ import annotations

import os
import shlex
import sys

FUNCTION = "BASH_FUNC_python%%"
"""How bash hands down a function named python; rules call it last, so that `exec` may be used."""


def set_environment(house: str) -> None:
    """Let `python -m vidtrack` in a rule mean this Python and the package that lies in `house`."""
    folder = os.path.dirname(sys.executable)
    _prepend("PATH", folder)
    if not _is_this_python(os.path.join(folder, "python")):  # Debian's own has no name but python3
        os.environ[FUNCTION] = f'() {{ exec {shlex.quote(sys.executable)} "$@"; }}'
    _prepend("PYTHONPATH", house)
    # A job's arrays are small: a library that takes every core for them only slows the other jobs, and the decoder
    # that works beside the tracking.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        os.environ.setdefault(variable, "1")


def _is_this_python(path: str) -> bool:
    try:
        return os.path.samefile(path, sys.executable)
    except OSError:
        return False


def _prepend(variable: str, folder: str) -> None:
    rest = [part for part in os.environ.get(variable, "").split(os.pathsep) if part and part != folder]
    os.environ[variable] = os.pathsep.join([folder, *rest])

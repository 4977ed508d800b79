"""Every format of runs that are odd: what it cannot hold is one line, never a traceback or a RuntimeWarning."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from tests.exchange.runs import camera, run
from tests.exchange.test_digitised import digitised_run
from tests.exchange.thesis.test_results import run as pair_run
from vidtrack.errors import VidtrackError
from vidtrack.exchange.formats import FORMATS, written


def changed(own, change):
    return replace(own, tables={name: change(table) for name, table in own.tables.items()})


def without_places(table):
    """All numbers NaN, the moments stay."""
    real = [c for c in table if table[c].dtype.kind == "f" and c not in ("time_s", "start_s", "end_s")]
    return table.assign(**dict.fromkeys(real, np.nan))


def of_targets(change):
    return lambda own: changed(own, lambda table: change(table) if "target" in table and "time_s" in table else table)


ODD = {
    "no sample": lambda own: changed(own, lambda table: table.iloc[:0]),
    "one sample": of_targets(lambda table: table[table["time_s"] == table["time_s"].min()]),
    "nothing located": lambda own: changed(own, without_places),
    "one target": of_targets(lambda table: table[table["target"] == table["target"].iloc[0]]),
    "a comma, a quote and letters that are not ASCII": of_targets(
        lambda table: table.assign(target=table["target"].astype(str) + " a,b\"; \u00fc'")
    ),
    "a tab in a name": of_targets(lambda table: table.assign(target=table["target"].astype(str) + "\tx\n")),
    "a name of 300 letters": of_targets(lambda table: table.assign(target=table["target"].astype(str) + "x" * 300)),
    "no camera": lambda own: replace(own, cameras={}),
    "no z": lambda own: replace(of_targets(lambda t: t.assign(z=np.nan) if "z" in t else t)(own), is_flat=True),
}


@pytest.mark.parametrize("odd", ODD)
def test_every_format_holds_an_odd_run_or_refuses_it_in_one_line(odd):
    cameras = {name: camera(name) for name in ("cam1", "cam2")}
    for name, form in FORMATS.items():
        if "trajectories" not in form.reads and "bodies" not in form.reads and odd != "no camera":
            continue  # cameras alone, which are not odd
        own = digitised_run() if "tracklets" in form.reads else run(cameras=cameras)
        own = ODD[odd](pair_run() if "points" in form.reads else own)
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                files = written(name, own).files
            except VidtrackError as error:
                files, said = {}, str(error)
            else:
                said = ""
        assert "\n" not in said, name
        assert said.endswith(".") or (files and all(files.values())), name

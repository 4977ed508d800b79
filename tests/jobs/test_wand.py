"""The job reads tracks and readings of a wand, and writes every camera's calibration."""

import numpy as np
import pytest

from tests.calibration.wand.waved import rigid_error, waved
from tests.stages.test_wand import tables
from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json, write_json, write_png
from vidtrack.files.tables import write_parquet
from vidtrack.jobs.wand import run
from vidtrack.workflow.job import Job

READOUT = 0.025


@pytest.fixture(scope="module")
def rolling(tmp_path_factory):
    """A wand before two cameras whose rows are read one after the other: their maker says so, or the config."""
    folder, scene = tmp_path_factory.mktemp("wand"), waved(61, n=200, readout=READOUT)
    inputs = {"tracks": [], "readings": [], "backgrounds": []}
    stated = {"ms": 1e3 * READOUT, "source": "GoPro's SROT", "doubt": "", "steady": True}
    for i, (name, table) in enumerate(tables(scene).items()):
        width, height = scene.cameras[i].image_size
        paths = {kind: str(folder / f"{name}_{kind}") for kind in inputs}
        write_parquet(paths["tracks"], table, units="px", provenance={})
        video = {"width": width, "height": height} | ({"readout": stated} if i == 0 else {})
        write_json(paths["readings"], {"video": video}, {})
        write_png(paths["backgrounds"], np.zeros((1, 1), np.uint16))
        for kind, path in paths.items():
            inputs[kind].append(path)
    own = {"Cx": None, "Cy": None, "sensor": [8.8, 6.6], "fix": {}, "prior": {}}
    clock = {"offset_s": 0.0, "rate_ppm": 0.0}
    settings = {"units": "in", "clip": "wand", "cameras": {f"cam{i}": own | {"clock": clock} for i in (1, 2)}}
    settings |= {"model": "tsai", "lengths": {"A-B": 20.0}, "sigma": 0.002, "axes": "camera", "surveyed": []}
    settings |= {"bare": ["cam1", "cam2"], "drop_cameras": [], "readout_ms": {"cam2": 1e3 * READOUT}}
    outputs = {name: str(folder / name) for name in ("record", "table")}
    parts = ("camera", "points", "labelling", "sightings", "background")
    outputs |= {f"{part}_{i}": str(folder / f"{part}_{i}") for part in parts for i in (0, 1)}
    return Job(settings, inputs, outputs, {}), scene


def test_a_wand_before_rolling_shutters_calibrates_as_before_others(rolling):
    """Without the read-out of 25 ms the error is four times the floor."""
    job, scene = rolling
    run(job)
    found = [read_camera(job.outputs[f"camera_{i}"]).camera for i in (0, 1)]
    error, floor = rigid_error(found, scene.cameras, np.random.default_rng(0))
    assert error < 1.5 * floor
    assert "readout-of-maker" in [f["code"] for f in read_json(job.outputs["record"])["findings"]]

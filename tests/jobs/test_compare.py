import numpy as np
import pandas as pd
import pytest

from tests.exchange.points.test_c3d import written
from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json
from vidtrack.files.tables import write_parquet
from vidtrack.jobs.compare import run
from vidtrack.workflow.job import Job

TIME = np.arange(200) / 100
PATH = np.stack([30 * np.cos(5 * TIME), 10 * np.sin(5 * TIME), 5 + 0 * TIME], -1)


def job(tmp_path, **settings) -> Job:
    table = pd.DataFrame(
        {"time_s": TIME + 36000, "timecode": "", "target": "a", **dict(zip("xyz", PATH.T, strict=True))}
    )
    table = table.assign(sigma_x=0.1, sigma_y=0.1, sigma_z=0.1, miss=0.0, n_cameras=2, flag="")
    write_parquet(tmp_path / "t.parquet", table, units="mm", provenance={})
    order = {"units": "mm", "run": "r1", "mode": "space", "time": None, "value": None, "axis": None, "target": None}
    outputs = {"comparison": str(tmp_path / "c.json"), "series": str(tmp_path / "c.parquet")}
    return Job(order | settings, {"trajectories": str(tmp_path / "t.parquet")}, outputs)


def test_points_of_a_c3d_file_are_the_truth(tmp_path):
    own = job(tmp_path, truth={"offset_s": 36000.0})
    own.inputs["truth"] = str(written(tmp_path / "truth.c3d", (PATH[:, None] + 0.25).astype(np.float32), names=("a",)))
    run(own)
    truth = read_json(own.outputs["comparison"])["truth"]
    assert truth["n"] == 200
    assert truth["bias"] == {axis: pytest.approx(-0.25, abs=1e-4) for axis in "xyz"}


def test_a_point_of_a_c3d_file_is_the_reference_and_its_column_is_asked_for(tmp_path):
    own = job(tmp_path, time="time_s", value="a_x", axis="x", offset_s=36000.0)
    own.inputs["reference"] = str(written(tmp_path / "reference.c3d", PATH[:, None].astype(np.float32), names=("a",)))
    run(own)
    record = read_json(own.outputs["comparison"])
    assert abs(record["lag_s"]) < 1e-4
    own.settings["value"] = ""
    with pytest.raises(VidtrackError, match=r"runs\.r1\.reference\.value: .* a_x, a_y, a_z"):
        run(own)

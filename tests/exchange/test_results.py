"""From files under results/ to what the writers take."""

import json

import numpy as np
import pytest

from tests.exchange.runs import bodies, camera, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.formats import FORMATS, Layout
from vidtrack.exchange.results import layout_of, read_run, result_paths, unsuited
from vidtrack.files.camera_json import write_camera
from vidtrack.files.experiment import Run
from vidtrack.files.tables import write_parquet
from vidtrack.geometry.camera import project
from vidtrack.settings.config import settings_from_config

CONFIG = {"units": "m", "cameras": {"cam1": {}, "cam2": {}}}
RECORDED = Run("pluck", {"cam1": "cam1.mov", "cam2": "cam2.mov"}, None, None, None)


def test_the_layout_of_a_run_is_known_from_the_config():
    assert layout_of(settings_from_config(CONFIG), RECORDED) == Layout("pluck", "space", ("cam1", "cam2"))
    own = {"pluck": {"bodies": {"float": {"a": [0, 0, 0]}}, "axes": {"waves": "+x", "up": "+z"}}}
    layout = layout_of(settings_from_config({**CONFIG, "runs": own}), RECORDED)
    assert (layout.bodies, layout.analysed) == (("float",), True)


def test_only_what_the_format_reads_and_the_run_has_is_named():
    layout = Layout("pluck", "space", ("cam1", "cam2"))
    assert result_paths("results", FORMATS["c3d"], layout) == {
        "trajectories": ["results/runs/pluck/trajectories.parquet"]
    }
    assert list(result_paths("results", FORMATS["csv"], layout)) == ["trajectories", "kinematics"]
    assert "bodies" in result_paths("results", FORMATS["csv"], layout._replace(bodies=("float",)))


def test_tables_clocks_and_provenance_are_read(tmp_path):
    write_parquet(tmp_path / "trajectories.parquet", trajectories(), units="m", provenance={"vidtrack": "9.9"})
    write_parquet(tmp_path / "bodies.parquet", bodies(), units="m", provenance={})
    clocks = {"cameras": {"cam1": {"offset_s": 0.5, "rate_ppm": None}}}
    (tmp_path / "locate.json").write_text(json.dumps({"clocks": clocks}))
    paths = {name: [str(tmp_path / f"{name}.parquet")] for name in ("trajectories", "bodies")}
    run = read_run(paths | {"locate": [str(tmp_path / "locate.json")]}, "pluck", "m", {"waves": "+x", "up": "+z"})
    assert len(run.tables["trajectories"]) == len(trajectories())
    assert run.clocks == {"cam1": {"offset_s": 0.5, "rate_ppm": 0.0}}
    assert (run.version, run.waves, run.up) == ("9.9", "+x", "+z")


def test_a_result_that_is_not_there_is_named():
    with pytest.raises(VidtrackError, match=r"trajectories.parquet: not there yet. Call vidtrack run first."):
        read_run({"trajectories": ["results/runs/pluck/trajectories.parquet"]}, "pluck", "m")


def test_a_camera_is_as_the_pictures_of_the_run_have_it(tmp_path):
    own = camera()
    write_camera(tmp_path / "camera.json", own, None, {"units": "m"})
    part = {"left": 100.0, "top": 40.0, "width": 256.0, "height": 240.0, "columns": 512, "rows": 480}
    (tmp_path / "locate.json").write_text(json.dumps({"pictures": {"cam1": part}}))
    paths = {"cameras": [str(tmp_path / "camera.json")], "locate": [str(tmp_path / "locate.json")]}
    seen = read_run(paths, "pluck", "m").cameras["cam1"]
    p = np.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(project(seen, p), (project(own, p) + 0.5 - [100, 40]) * 2 - 0.5)


def test_what_no_run_can_give_is_known_before_anything_runs():
    flat = {"pluck": {"mode": "plane", "plane": {"scale": 0.1}}}
    other = Run("still", {"cam1": "cam1.mov", "cam2": "cam2.mov"}, None, None, None)
    config = {**CONFIG, "export": ["c3d", "mot"], "runs": flat}
    (only,) = unsuited(settings_from_config(config), [RECORDED, other])
    assert "no run can be written as mot" in only
    alone = unsuited(settings_from_config(config), [RECORDED])
    assert [line.split(";")[0] for line in alone] == [
        "config.yaml: export: no run can be written as c3d",
        "config.yaml: export: no run can be written as mot",
    ]
    own = {**CONFIG, "runs": {"pluck": {"export": ["csv", "qtm", "mot"]}}}
    assert unsuited(settings_from_config(own), [RECORDED]) == [
        "config.yaml: runs.pluck.export: it cannot be written as mot: the config names no bodies for it. Remove mot."
    ]

"""One run's tables, records and Dataset."""

import json

import numpy as np
import pytest

from tests.exchange.runs import bodies, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.files.outdated_note import write_note
from vidtrack.files.tables import write_parquet
from vidtrack.notebook.run import LoadedRun


@pytest.fixture
def run(tmp_path):
    write_parquet(tmp_path / "trajectories.parquet", trajectories(), units="m", provenance={})
    write_parquet(tmp_path / "bodies.parquet", bodies(), units="m", provenance={})
    (tmp_path / "centroids").mkdir()
    write_parquet(tmp_path / "centroids/cam1.parquet", trajectories(), units="m", provenance={})
    return LoadedRun("pluck", str(tmp_path), "m", {"waves": "+x", "up": "+z"})


def test_tables_are_listed_and_carry_their_units(run):
    assert run.tables == ["bodies", "trajectories", "centroids/cam1"]
    assert run.bodies.attrs["units"]["roll"] == "deg"
    assert len(run.table("centroids/cam1")) == len(trajectories())
    with pytest.raises(VidtrackError, match="no table 'motions'; there are bodies"):
        _ = run.motions


def test_the_dataset_has_what_there_is(run):
    data = run.to_xarray()
    assert {"position", "body_position"} <= set(data)
    assert "velocity" not in data
    assert data.attrs["axis_up"] == "+z"
    own = trajectories().query("target == 'stern'")["x"]
    np.testing.assert_array_equal(data["position"].sel(space="x", keypoint="stern").squeeze(), own)
    assert run.xarray is run.xarray


def test_a_run_in_a_plane_has_two_coordinates(tmp_path):
    table = trajectories()
    table["z"] = np.nan
    write_parquet(tmp_path / "trajectories.parquet", table, units="m", provenance={})
    (tmp_path / "locate.json").write_text(json.dumps({"mode": "plane"}))
    assert LoadedRun("pluck", str(tmp_path), "m").to_xarray().sizes["space"] == 2


def test_a_record_that_is_not_there_is_named(run):
    with pytest.raises(VidtrackError, match=r"comparison\.json: no such record"):
        run.record("comparison")


def test_a_table_of_an_earlier_call_is_read_with_a_warning(tmp_path):
    folder = tmp_path / "runs/pluck"
    write_parquet(folder / "trajectories.parquet", trajectories(), units="m", provenance={})
    write_note(str(folder), ["runs/pluck/trajectories.parquet"])
    with pytest.warns(UserWarning, match="of an earlier call"):
        assert len(LoadedRun("pluck", str(folder), "m").trajectories) == len(trajectories())

"""TRC and MOT, read by the lines of OpenSim's own description of them."""

import numpy as np
import pytest

from tests.exchange.runs import RATE, bodies, run, times, trajectories
from vidtrack.errors import VidtrackError
from vidtrack.exchange.opensim import write_mot, write_trc


def trc(own):
    return write_trc(own).files["pluck.trc"].decode().split("\n")


def points(lines):
    """(n, m, 3), NaN where cells are empty."""
    rows = [line.split("\t")[2:] for line in lines[6:] if line]
    return np.array([[float(cell) if cell else np.nan for cell in row] for row in rows]).reshape(len(rows), -1, 3)


def test_the_header_has_its_eight_keys_and_their_values():
    lines = trc(run())
    keys, values = lines[1].split("\t"), lines[2].split("\t")
    assert " ".join(keys[:5]) == "DataRate CameraRate NumFrames NumMarkers Units"
    assert keys[5:] == ["OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"]
    header = dict(zip(keys, values, strict=True))
    assert float(header["DataRate"]) == pytest.approx(RATE, rel=1e-6)
    assert (header["NumFrames"], header["NumMarkers"], header["Units"]) == ("60", "3", "mm")
    assert lines[3].split("\t")[2::3][:3] == ["bow", "Bälle é", "stern"]
    assert lines[4].split("\t")[2:] == [f"{a}{i}" for i in (1, 2, 3) for a in "XYZ"]
    assert lines[5] == ""


def test_every_number_comes_back_and_missing_cells_are_empty():
    lines = trc(run())
    own = trajectories().query("target == 'stern'").set_index("time_s")[["x", "y", "z"]].reindex(times()) * 25.4
    np.testing.assert_array_equal(points(lines)[:, 2], own)
    assert "nan" not in "\n".join(lines).lower()
    assert all(line.count("\t") == 10 for line in lines[6:] if line)
    assert [line.split("\t")[0] for line in lines[6:9]] == ["1", "2", "3"]
    assert float(lines[6].split("\t")[1]) == pytest.approx(times()[0], abs=1e-6)


def test_up_becomes_y_where_the_config_knows_it():
    level, turned = points(trc(run())), points(trc(run(waves="-x", up="+z")))
    np.testing.assert_allclose(turned[..., 0], -level[..., 0])
    np.testing.assert_allclose(turned[..., 1], level[..., 2])
    np.testing.assert_allclose(turned[..., 2], level[..., 1])
    three = turned[0] @ np.linalg.inv(level[0])
    assert np.linalg.det(three) == pytest.approx(1.0)


def test_axes_that_are_not_known_are_said():
    assert any("OpenSim takes Y up" in note for note in write_trc(run()).notes)


def test_a_name_with_a_tab_is_refused():
    with pytest.raises(VidtrackError, match="tab"):
        write_trc(run(tables={"trajectories": trajectories(["a\tb"])}))


def mot(own):
    lines = write_mot(own).files["pluck.mot"].decode().splitlines()
    start = lines.index("endheader")
    header = dict(line.split("=") for line in lines[1:start] if "=" in line)
    return header, lines[start + 1].split("\t"), np.array([line.split("\t") for line in lines[start + 2 :]], float)


def test_motions_of_bodies_are_in_metres_and_degrees():
    header, names, values = mot(run())
    assert (header["nRows"], header["nColumns"], header["inDegrees"]) == ("54", "7", "yes")
    assert names == ["time", "float_tx", "float_ty", "float_tz", "float_roll", "float_pitch", "float_yaw"]
    own = bodies().dropna(subset="x")
    np.testing.assert_allclose(values[:, 1:4], own[["x", "y", "z"]] * 0.0254, rtol=1e-15)
    np.testing.assert_array_equal(values[:, 4:], own[["roll", "pitch", "yaw"]])


def test_a_body_missing_beside_another_is_nan_and_a_moment_without_any_has_no_row():
    table = bodies(("a", "b"))
    table.loc[(table["body"] == "a") & (table["time_s"] == times()[9]), ["x", "y", "z", "roll", "pitch", "yaw"]] = (
        np.nan
    )
    own = run(tables={"bodies": table})
    _, _, values = mot(own)
    assert len(values) == 54
    assert np.isnan(values[8, 1:7]).all()
    assert np.isfinite(values[8, 7:]).all()
    assert write_mot(own).notes == ["1 moments at which no body is located have no row"]

import numpy as np
import pandas as pd
import pytest

from tests.exchange.tracks.made import positions
from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks


def saved(path, b, **kwargs):
    """As pandas saves the table of trackpy.link: an index, y before x, and columns of its features."""
    rows = [(at[1], at[0], 9.0, k, i) for k, row in enumerate(b) for i, at in enumerate(row) if np.isfinite(at).all()]
    table = pd.DataFrame(rows, columns=["y", "x", "mass", "frame", "particle"])
    table.to_csv(path, **kwargs)
    return table


@pytest.mark.parametrize("kwargs", [{}, {"index": False}, {"sep": ";", "decimal": ","}, {"lineterminator": "\r\n"}])
def test_particles_of_a_table_that_pandas_saved_are_read_exactly(tmp_path, kwargs):
    b = positions()
    saved(tmp_path / "cam1.csv", b, **kwargs)
    tracks = read_tracks(tmp_path / "cam1.csv", Convention(), "runs.a.tracks")
    np.testing.assert_array_equal(placed(tracks, Convention(), "runs.a.tracks"), b)
    assert tracks.names == ("p0", "p1") or tracks.names == ("p1", "p0")
    assert not tracks.named


def test_detections_that_were_not_linked_are_refused(tmp_path):
    saved(tmp_path / "cam1.csv", positions()).drop(columns="particle").to_csv(tmp_path / "cam1.csv")
    with pytest.raises(VidtrackError, match="detections, not tracks"):
        read_tracks(tmp_path / "cam1.csv", Convention(), "here")


def test_a_particle_twice_in_a_frame_is_refused(tmp_path):
    table = saved(tmp_path / "cam1.csv", positions())
    pd.concat([table, table.iloc[[4]]]).to_csv(tmp_path / "cam1.csv")
    with pytest.raises(VidtrackError, match="repeat a particle"):
        read_tracks(tmp_path / "cam1.csv", Convention(), "here")

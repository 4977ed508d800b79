import h5py
import numpy as np
import pandas as pd
import pytest

from tests.exchange.tracks.made import positions
from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks

NODES = ["head", "thorax"]


def analysis(path, b, tracks=("animal",)):
    """SLEAP's analysis file: tracks (tracks, 2, nodes, frames), written as sleap.io.convert does."""
    with h5py.File(path, "w") as file:
        whole = np.stack([b + 10 * k for k in range(len(tracks))])  # tracks, frames, nodes, 2
        file.create_dataset("tracks", data=np.transpose(whole, (0, 3, 2, 1)), compression="gzip")
        file["node_names"] = np.array(NODES, "S")
        file["track_names"] = np.array(tracks, "S")


def test_the_nodes_of_an_analysis_file_are_read_exactly(tmp_path):
    b = positions()
    analysis(tmp_path / "cam1.h5", b)
    tracks = read_tracks(tmp_path / "cam1.h5", Convention(), "here")
    assert tracks.names == ("head", "thorax")
    assert tracks.named
    np.testing.assert_array_equal(placed(tracks, Convention(first=(0.5, 0.5)), "here"), b - 0.5)


def test_where_the_centre_of_the_first_pixel_is_is_asked_for(tmp_path):
    analysis(tmp_path / "cam1.h5", positions())
    tracks = read_tracks(tmp_path / "cam1.h5", Convention(), "runs.a.tracks")
    with pytest.raises(VidtrackError, match=r"runs\.a\.tracks\.first_pixel"):
        placed(tracks, Convention(), "runs.a.tracks")


@pytest.mark.parametrize(("tracks", "named"), [(("left", "right"), True), (("track_0", "track_1"), False)])
def test_numbers_of_tracks_mean_nothing_in_another_camera_names_do(tmp_path, tracks, named):
    analysis(tmp_path / "cam1.h5", positions(), tracks)
    found = read_tracks(tmp_path / "cam1.h5", Convention(), "here")
    assert found.named is named
    assert found.names[0] == f"{tracks[0]}_head"


def test_the_csv_holds_the_same(tmp_path):
    b = positions()
    rows = [
        {"track": "animal", "frame_idx": k, "instance.score": 0.9}
        | {f"{n}.{axis}": b[k, i, j] for i, n in enumerate(NODES) for j, axis in enumerate("xy")}
        | {f"{n}.score": 0.8 for n in NODES}
        for k in range(len(b))
    ]
    pd.DataFrame(rows).to_csv(tmp_path / "cam1.csv", index=False)
    found = read_tracks(tmp_path / "cam1.csv", Convention(), "here")
    assert found.names == ("head", "thorax")
    np.testing.assert_array_equal(found.b, b)


def test_instances_without_tracks_are_refused(tmp_path):
    text = "track,frame_idx,instance.score,head.x,head.y,head.score\n,0,1,1,2,1\n,0,1,3,4,1\n"
    (tmp_path / "cam1.csv").write_text(text)
    with pytest.raises(VidtrackError, match="instances have no tracks"):
        read_tracks(tmp_path / "cam1.csv", Convention(), "here")

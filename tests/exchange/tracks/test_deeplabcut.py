import os

import numpy as np
import pandas as pd
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention
from vidtrack.exchange.tracks.formats import read_tracks

HERE = os.path.join(os.path.dirname(__file__), "data")
"""Written by pandas and PyTables (to_csv, to_hdf), as DeepLabCut and anipose do; the numbers are random."""
SAID = Convention(likelihood=0.6)


@pytest.mark.parametrize("name", ["deeplabcut.csv", "deeplabcut_table.h5", "deeplabcut_fixed.h5"])
def test_csv_and_hdf5_hold_what_pandas_reads(name):
    tracks = read_tracks(os.path.join(HERE, name), SAID, "runs.a.tracks")
    theirs = pd.read_csv(os.path.join(HERE, "deeplabcut.csv"), header=[0, 1, 2], index_col=0)
    theirs.columns = theirs.columns.droplevel(0)
    assert tracks.names == ("nose", "tail é")
    assert (tracks.frame == theirs.index).all()
    for i, part in enumerate(tracks.names):
        own = theirs[part]
        expected = own[["x", "y"]].where(own["likelihood"] >= 0.6).to_numpy()
        np.testing.assert_array_equal(tracks.b[:, i], expected)
    assert np.isnan(tracks.b).any()


def test_the_least_likelihood_is_asked_for():
    with pytest.raises(VidtrackError, match=r"config.yaml: runs\.a\.tracks\.likelihood"):
        read_tracks(os.path.join(HERE, "deeplabcut.csv"), Convention(), "runs.a.tracks")


def test_several_animals_and_hand_labels_are_read(tmp_path):
    path = tmp_path / "cam1.csv"
    path.write_text(
        "scorer,me,me,me,me\nindividuals,mouse1,mouse1,single,single\nbodyparts,nose,nose,corner,corner\n"
        "coords,x,y,x,y\nlabeled-data/a/img012.png,1.5,2.5,3,4\nlabeled-data/a/img003.png,,,5,6\n"
    )
    tracks = read_tracks(path, Convention(), "here")
    assert tracks.names == ("mouse1_nose", "corner")
    assert tracks.frame.tolist() == [3, 12]
    np.testing.assert_array_equal(tracks.b[:, 0], [[np.nan, np.nan], [1.5, 2.5]])


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("scorer,a,a\nbodyparts,n,n\n1,2,3\n", "not scorer, bodyparts, coords"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,y\n0,1\n", "Copy the whole file again"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,u,v\n0,1,2\n", "no column x and y"),
        ("scorer,a,a\nbodyparts,n,n\ncoords,x,y\n0,1,2\n0,1,2\n", "two rows"),
    ],
)
def test_a_table_that_is_not_whole_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "cam1.csv").write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_tracks(tmp_path / "cam1.csv", SAID, "here")
    assert "\n" not in str(error.value)


def test_hdf5_that_breaks_off_is_refused(tmp_path):
    with open(os.path.join(HERE, "deeplabcut_table.h5"), "rb") as file:
        (tmp_path / "cam1.h5").write_bytes(file.read()[:3000])
    with pytest.raises(VidtrackError, match="not a whole HDF5 file"):
        read_tracks(tmp_path / "cam1.h5", SAID, "here")


def test_names_that_would_run_code_are_refused(tmp_path):
    import h5py

    with h5py.File(tmp_path / "cam1.h5", "w") as file:
        group = file.create_group("df")
        group.attrs["pandas_type"] = "frame_table"
        own = group.create_dataset("table", data=np.zeros(1, [("index", "i8"), ("values_block_0", "f8", (2,))]))
        own.attrs["values_block_0_kind"] = np.bytes_(b"cos\nsystem\n(S'true'\ntR.")
    with pytest.raises(VidtrackError, match="in a form that is not known"):
        read_tracks(tmp_path / "cam1.h5", SAID, "here")

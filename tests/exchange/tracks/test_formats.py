import fcntl
from pathlib import Path

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention
from vidtrack.exchange.tracks.formats import read_tracks


def test_the_thesis_tracks_carry_their_time_code(tmp_path):
    path = tmp_path / "cam1.prn"
    path.write_text("a\nb\nc\nd\n" + "".join(f" 10:00:55:{k:02d}\t\t {100 + k}.25 200.50\n" for k in range(5)))
    tracks = read_tracks(path, Convention(), "here")
    assert tracks.code[0] == "10:00:55:00"
    assert tracks.rate == pytest.approx(30 / 1.001)
    assert tracks.b[1, 0].tolist() == [101.25, 200.5]


@pytest.mark.parametrize(
    ("name", "data", "what"),
    [
        ("cam1.csv", b"time,a,b\n0,1,2\n", "of no program that is known"),
        ("cam1.xml", b"<a/>", "XML of no program"),
        ("cam1.csv", b"", "empty"),
        ("cam1.h5", b"\x89HDF\r\n\x1a\n", "not a whole HDF5"),
        ("cam1.csv", b"frame,particle,x,y\n0,0,nan,nan\n", "no target has a position"),
        ("cam1.csv", b"frame,particle,x,y\n-4,0,1,1\n", "below 0"),
        ("cam1.csv", bytes(range(256)), "not a text file"),
        ("cam1.csv", b"pt1_cam1_X,pt1_cam1_Y\n12,5,33,25\n", "line 2: 4 cells where the header has 2"),
        ("cam1.csv", b"pt1_cam1_X,pt1_cam1_Y\n12,33\n12,5,33\n", "line 3: 3 cells where the header has 2"),
        ("cam1.csv", b"pt1_cam1_X,pt1_cam1_Y,pt1_cam1_X,pt1_cam1_Y\n1,2,3,4\n", "pt1_cam1_X is there twice"),
        ("cam1.csv", b"frame,particle,x,y\n0.5,0,1,1\n", "frame 0.5 is no whole number"),
        ("cam1.csv", b"frame,x,y\n0,1,1\n", "no column particle"),
    ],
)
def test_what_is_no_file_of_tracks_is_refused_in_one_line(tmp_path, name, data, what):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(VidtrackError, match=what) as error:
        read_tracks(tmp_path / name, Convention(), "here")
    assert "\n" not in str(error.value)


def test_noise_in_place_of_a_file_ends_in_a_line_and_never_in_a_traceback(tmp_path):
    rng = np.random.default_rng(0)
    heads = [
        b"scorer,a,a\nbodyparts,n,n\ncoords,x,y\n",
        b"pt1_cam1_U,pt1_cam1_V\n",
        b"x,y,frame,particle\n",
        b"<TrackMate>",
    ]
    for k in range(60):
        path = tmp_path / "cam1.csv"
        path.write_bytes(heads[k % 4] + bytes(rng.integers(1, 256, 200, np.uint8)))
        with pytest.raises(VidtrackError) as error:
            read_tracks(path, Convention(likelihood=0.5), "here")
        assert "\n" not in str(error.value)


def test_hdf5_is_read_without_a_lock_which_a_network_folder_may_not_have(tmp_path):
    kept = Path(__file__).parents[1] / "public/sleap/tank.analysis.h5"
    path = tmp_path / "cam1.h5"
    path.write_bytes(kept.read_bytes())
    with path.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)  # who asks for a lock now is refused, as where there are none
        assert read_tracks(path, Convention(), "here").b.shape == (12, 6, 2)

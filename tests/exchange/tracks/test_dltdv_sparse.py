import io

import numpy as np
import pytest
from scipy.sparse import coo_array

from tests.exchange.tracks.made import SIZE, positions, sparse
from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks

WHERE = "runs.a.tracks"


def read(tmp_path, text, **said):
    path = tmp_path / "cam2.tsv"
    path.write_text(text)
    how = Convention(**({"camera": "2 of 3", "origin": "upper-left", "size": SIZE} | said))
    tracks = read_tracks(path, how, WHERE)
    return tracks, placed(tracks, how, WHERE)


def test_points_of_one_camera_are_read_with_their_frames_and_gaps(tmp_path):
    b = positions()
    b[3] = np.nan  # a frame in which nothing was digitised has no value
    tracks, found = read(tmp_path, sparse(b))
    assert tracks.names == ("pt1", "pt2")
    assert tracks.together
    np.testing.assert_array_equal(tracks.frame, np.delete(np.arange(len(b)), 3))
    np.testing.assert_allclose(found, np.delete(b, 3, 0), atol=6e-7)


def test_the_values_are_those_of_scipys_sparse_matrix_with_the_columns_of_dltdv(tmp_path):
    text = sparse(positions())
    i, j, value = np.loadtxt(io.StringIO(text), skiprows=2).T
    full = coo_array((value, (i.astype(int) - 1, j.astype(int) - 1))).toarray()
    full[full == 0] = np.nan  # as sp2full of DLTdv
    tracks, _ = read(tmp_path, text)
    for point in (0, 1):
        theirs = full[:, np.arange(2) + 2 * (2 - 1) + 2 * 3 * point]  # (vnum * 2 - 1 : vnum * 2) + (sp - 1) * 2 * nvid
        np.testing.assert_array_equal(tracks.b[:, point], theirs)


def test_the_corner_is_asked_for_as_of_the_flat_table(tmp_path):
    with pytest.raises(VidtrackError, match=r"runs\.a\.tracks\.origin"):
        read(tmp_path, sparse(positions()), origin=None)
    assert read(tmp_path, sparse(positions()), origin=None, format="dltdv8")[0].origin == "upper-left"


@pytest.mark.parametrize("camera", [None, "2", "0 of 3", "4 of 3", "2 of many"])
def test_how_many_cameras_there_are_is_asked_for(tmp_path, camera):
    with pytest.raises(VidtrackError, match=r"tracks\.camera: .*camera: 1 of 3"):
        read(tmp_path, sparse(positions()), camera=camera)


@pytest.mark.parametrize(
    ("change", "said", "what"),
    [
        (lambda text: text, {"camera": "2 of 5"}, "12 columns"),
        (lambda text: text, {"camera": "3 of 3"}, "nothing was digitised"),
        (lambda text: text.rsplit("\n", 3)[0] + "\n", {}, "line 2 counts"),
        (lambda text: text.replace("\t1\t7", "\t1.5\t7", 1), {}, "whole numbers"),
        (lambda text: text.replace("\t1\t7", "\t99\t7", 1), {}, "line 2 counts"),
        (lambda text: text.replace("camera", "3D"), {}, "xypts.tsv"),
        (lambda text: text.replace("7.0", "x", 1), {}, "three numbers a line"),
        (lambda text: text.split("\n")[0] + "\n", {}, "three numbers a line"),
    ],
)
def test_what_is_not_whole_is_refused_in_one_line(tmp_path, change, said, what):
    with pytest.raises(VidtrackError, match=what) as error:
        read(tmp_path, change(sparse(positions())), **said)
    assert "\n" not in str(error.value)


def test_a_small_file_cannot_ask_for_much_memory(tmp_path):
    n = 12_000
    lines = "".join(f"{k}\t{6 * k - 5}\t5.0\n{k}\t{6 * k - 4}\t5.0\n" for k in range(1, n + 1))
    text = f"Sparse format camera coordinates file\n{n}\t{6 * n}\t{2 * n}\n{lines}"
    with pytest.raises(VidtrackError, match="too many"):
        read(tmp_path, text, camera="1 of 3")

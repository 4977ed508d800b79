import numpy as np
import pytest

from tests.exchange.thesis.rig import points
from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.points import Sighted, write_picture_points, write_sighted
from vidtrack.exchange.tracks.digitised import Convention
from vidtrack.exchange.tracks.picture_points import read_points


def test_the_thesis_points_are_read_with_and_without_their_place(tmp_path):
    p = points(5)
    seen = Sighted(tuple("12345"), p[:, :2] * 5, np.full(5, 30.0), p)
    write_sighted(tmp_path / "cam1.prn", seen)
    found = read_points(tmp_path / "cam1.prn", Convention(), "here")
    np.testing.assert_allclose(found.b, seen.b, atol=0.005)
    assert (found.p == p).all()
    write_picture_points(tmp_path / "cam.dat", seen)
    assert np.isnan(read_points(tmp_path / "cam.dat", Convention(), "here").p).all()


def test_a_table_with_columns_of_the_frame_buffer_needs_no_more(tmp_path):
    (tmp_path / "cam1.csv").write_text("tag,Xf,Yf,sd\na1,10,20,0.2\nb é,30.5,,\n")
    found = read_points(tmp_path / "cam1.csv", Convention(), "here")
    assert found.tags == ("a1", "b é")
    np.testing.assert_array_equal(found.b, [[10, 20], [30.5, np.nan]])
    assert found.sd[0] == 0.2


def test_of_any_other_table_the_pixels_are_asked_for(tmp_path):
    (tmp_path / "cam1.csv").write_text("tag;x;y\n1;10,5;20\n")
    with pytest.raises(VidtrackError, match=r"here\.origin"):
        read_points(tmp_path / "cam1.csv", Convention(), "here")
    said = Convention(origin="lower-left", first=(1, 1), size=(640, 480))
    assert read_points(tmp_path / "cam1.csv", said, "here").b.tolist() == [[9.5, 460]]


@pytest.mark.parametrize(
    ("text", "what"), [("tag,a,b\n1,2,3\n", "no columns Xf, Yf"), ("tag,Xf,Yf\n1,2,3\n1,2,3\n", "appears twice")]
)
def test_a_table_without_positions_is_refused(tmp_path, text, what):
    (tmp_path / "cam1.csv").write_text(text)
    with pytest.raises(VidtrackError, match=what):
        read_points(tmp_path / "cam1.csv", Convention(), "here")

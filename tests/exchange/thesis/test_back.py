import numpy as np
import pytest

from tests.exchange.thesis.rig import points
from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.back import (
    Calced,
    Listed,
    read_calced,
    read_fblocate,
    read_iti,
    read_list,
    write_calced,
    write_list,
    write_pixels,
)

BY_BACK = (
    "calced.prn \n11:00:01 \n10/21/92 \n\nThis file contains the results\n\n\n"
    + "=" * 60
    + "\n"
    + "=" * 60
    + "\nfirst run, 90 degrees\n\n\nPoints Calculated 31   AvgError 0.112000\n"
    "Diagonal field of view\tcam1 = 148.2\tcam2 = 151.7\n\n"
    "AvgError inches\tX = 0.102\tY = 0.088\tZ = 0.146\nAvgErr/max dist\tX = 0.120%\tY = 0.104%\tZ = 0.172%\n"
    "AvgErr % field\tX = 0.068%\tY = 0.059%\tZ = 0.097%\nMaxError   \tX = -0.301\tY = 0.255\tZ = -0.440\n"
)
"""As the fprintf calls of back.c print it; the second line of = is list.prn's."""


def test_a_summary_of_back_is_read(tmp_path):
    path = tmp_path / "calced.prn"
    path.write_text(BY_BACK)
    found = read_calced(path)
    assert (found.description, found.points, found.mean_all) == ("first run, 90 degrees", 31, 0.112)
    assert found.field == (148.2, 151.7)
    assert found.mean.tolist() == [0.102, 0.088, 0.146]
    assert found.of_longest.tolist() == [0.120, 0.104, 0.172]
    assert found.of_field.tolist() == [0.068, 0.059, 0.097]
    assert found.most.tolist() == [-0.301, 0.255, -0.440]


def test_a_summary_that_is_written_is_read_to_its_digits(tmp_path):
    made = Calced("a", 12, 0.25, (100.5, 99.5), *(np.round(v, 3) for v in np.random.default_rng(0).normal(size=(4, 3))))
    write_calced(tmp_path / "calced.prn", made)
    found = read_calced(tmp_path / "calced.prn")
    for one, other in zip(made[4:], found[4:], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert found[:4] == made[:4]


def test_a_list_is_read_and_written_to_two_decimals(tmp_path):
    path = tmp_path / "list.prn"
    path.write_text(
        "list.prn \n\nTag calculated 4 AvgError 0.010000\nCalculated    10.12    -3.50     7.00\n"
        "World    10.00    -3.40     7.10\nDifference     0.12    -0.10    -0.10\n\n"
    )
    found = read_list(path)
    assert found.tags == ("4",)
    assert found.located.tolist() == [[10.12, -3.5, 7.0]]
    assert found.surveyed.tolist() == [[10.0, -3.4, 7.1]]
    p = points(6)
    write_list(path, Listed(tuple("123456"), p + 0.25, p))
    found = read_list(path)
    np.testing.assert_allclose(found.located, p + 0.25, atol=1e-9)
    assert "AvgError 0.250000" in path.read_text()


def test_screen_places_are_read_and_written_to_one_decimal(tmp_path):
    b = np.round(np.random.default_rng(2).uniform(-20, 500, (7, 4, 2)), 1)
    write_pixels(tmp_path / "fblocate.prn", b, "fblocate.prn")
    assert (read_fblocate(tmp_path / "fblocate.prn") == b).all()
    write_pixels(tmp_path / "vid1iti.prn", b[:, :2], "vid1iti.prn")
    assert (read_iti(tmp_path / "vid1iti.prn") == b[:, :2]).all()
    with pytest.raises(VidtrackError, match="4 numbers where a point has 8"):
        read_fblocate(tmp_path / "vid1iti.prn")
    with pytest.raises(VidtrackError, match="not in front"):
        write_pixels(tmp_path / "fblocate.prn", np.full((1, 4, 2), np.nan), "fblocate.prn")


@pytest.mark.parametrize("cut", [200, 420, -60])
def test_a_summary_that_breaks_off_is_refused(tmp_path, cut):
    path = tmp_path / "calced.prn"
    path.write_text(BY_BACK[:cut])
    with pytest.raises(VidtrackError, match="Copy the whole file again"):
        read_calced(path)


def test_a_list_that_breaks_off_is_refused(tmp_path):
    path = tmp_path / "list.prn"
    p = points(3)
    write_list(path, Listed(tuple("123"), p, p))
    path.write_text(path.read_text().rsplit("World", 1)[0])
    with pytest.raises(VidtrackError, match="breaks off"):
        read_list(path)

import numpy as np
import pytest

from tests.exchange.thesis.rig import points
from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.points import (
    Sighted,
    Survey,
    joined,
    read_picture_points,
    read_sighted,
    read_targets,
    read_world,
    write_picture_points,
    write_sighted,
    write_targets,
    write_world,
)

BY_SUBCAPT = (
    " calocate.prn \n 10:21:33 \n 10/21/92 \n\nThis file is written by subcapt.exe\nand showcalb.exe.\n"
    "count and world point location\n\nPoint X Y Pixel X Y Z\nTag cent cent Total w w w\n"
    + "=" * 76
    + " \n7\t101.50\t220.25\t31\t12.00\t3.50\t-4.00\n3\t301.25\t120.50\t28\t22.00\t13.50\t14.00\n"
)
"""As the fprintf calls of subcapt.c print it: eleven lines of header."""


def skipped_by(text: str, pieces: int, longest: int) -> str:
    """What is left of a text after so many calls of fgets that take `longest` - 1 characters at most."""
    for _ in range(pieces):
        end = text.find("\n")
        text = text[min(end + 1 if end >= 0 else len(text), longest - 1) :]
    return text


def test_what_subcapt_printed_is_read_with_all_its_points(tmp_path):
    path = tmp_path / "cam1.prn"
    path.write_text(BY_SUBCAPT)
    found = read_sighted(path)
    assert found.tags == ("7", "3")
    assert found.b.tolist() == [[101.5, 220.25], [301.25, 120.5]]
    assert found.pixels.tolist() == [31, 28]
    assert found.p.tolist() == [[12.0, 3.5, -4.0], [22.0, 13.5, 14.0]]


def test_back_loses_the_first_point_that_subcapt_wrote_and_calb_does_not_and_ours_neither():
    assert skipped_by(BY_SUBCAPT, 12, 127).startswith("3\t")
    assert skipped_by(BY_SUBCAPT.replace("=" * 76, "=" * 90), 12, 80).startswith("7\t")


@pytest.mark.parametrize("longest", [80, 127])
def test_the_old_programs_read_every_point_of_what_is_written(tmp_path, longest):
    path = tmp_path / "cam1.prn"
    p = points(5)
    write_sighted(path, Sighted(tuple("12345"), p[:, :2] * 5, np.full(5, 30.0), p))
    left = skipped_by(path.read_text(), 12, longest)
    assert left.split("\t")[0] == "1"
    assert len(left.split("\n")) == 5


def test_points_that_are_written_are_read_to_the_digits_of_the_file(tmp_path):
    path = tmp_path / "cam1.prn"
    p = points()
    seen = Sighted(tuple(str(k) for k in range(1, 25)), p[:, :2] * 5, np.arange(24.0), p)
    write_sighted(path, seen)
    found = read_sighted(path)
    assert found.tags == seen.tags
    np.testing.assert_allclose(found.b, seen.b, atol=0.005)
    assert (found.p == seen.p).all()
    assert (found.pixels == seen.pixels).all()


def test_a_survey_is_read_as_subcapt_scans_it_and_numbers_without_a_survey_are_left_out(tmp_path):
    path = tmp_path / "balls.dat"
    path.write_text("1\n2\n3\n4\n5\n0 0\n1 1 10 20 30\n2 0\n3 1\n-1,5 2 3.25\n")
    found = read_targets(path)
    assert found.tags == ("1", "3")
    assert found.p.tolist() == [[10, 20, 30], [-1.5, 2, 3.25]]


def test_a_survey_that_is_written_is_read_to_the_last_digit(tmp_path):
    path = tmp_path / "targets.dat"
    survey = Survey(("2", "5"), np.array([[1 / 3, 2, 3], [4, 5e-3, 6]]))
    write_targets(path, survey)
    found = read_targets(path)
    assert found.tags == survey.tags
    assert (found.p == survey.p).all()
    assert not path.read_bytes().endswith(b"\n")


def test_seen_points_and_survey_of_two_files_become_one(tmp_path):
    p = points(4)
    seen = Sighted(tuple("3142"), p[:, :2], np.array([5.0, 6, 7, 8]), np.full((4, 3), np.nan))
    write_picture_points(tmp_path / "cam.dat", seen)
    write_world(tmp_path / "world.dat", Survey(tuple("1234"), p))
    found = joined(read_picture_points(tmp_path / "cam.dat"), read_world(tmp_path / "world.dat"))
    assert (found.p == p[[2, 0, 3, 1]]).all()
    np.testing.assert_allclose(found.b, p[:, :2], atol=1e-6)
    with pytest.raises(VidtrackError, match="point 3 was seen"):
        joined(seen, Survey(tuple("12"), p[:2]))


@pytest.mark.parametrize(
    ("read", "text", "what"),
    [
        (read_sighted, BY_SUBCAPT[:-20], "4 numbers|5 numbers"),
        (read_sighted, BY_SUBCAPT.replace("\n3\t", "\n7\t"), "appears twice"),
        (read_targets, "1\n2\n3\n4\n5\n0 2 3\n", "line 6"),
        (read_targets, "1\n2\n3\n4\n5\n", "no surveyed point"),
        (read_world, "1 2 3\n", "3 numbers"),
    ],
)
def test_a_file_that_breaks_off_or_is_another_is_refused_in_one_line(tmp_path, read, text, what):
    path = tmp_path / "x.prn"
    path.write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read(path)
    assert "\n" not in str(error.value)


def test_tags_that_the_old_programs_do_not_know_are_refused(tmp_path):
    with pytest.raises(VidtrackError, match="no whole number"):
        write_world(tmp_path / "world.dat", Survey(("left",), np.zeros((1, 3))))

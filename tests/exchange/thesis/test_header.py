import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.header import body_of, header


def test_a_header_has_the_height_that_the_old_programs_skip_each_line_in_one_piece():
    text = header("cam1.prn", ("one", "two"), height=12)
    lines = text.split("\n")
    assert len(lines) == 13
    assert lines[-1] == ""
    assert lines[11].startswith("=====")
    assert max(map(len, lines)) < 79


def test_a_body_begins_after_the_last_line_of_equals_signs_or_where_numbers_begin(tmp_path):
    path = tmp_path / "list.prn"
    path.write_text("a\n=====\nb\n=======\n1 2\n")
    assert body_of(path, "points") == [(5, "1 2")]
    path.write_text("a\nb\n1 2\n3 4\n")
    assert body_of(path, "points") == [(3, "1 2"), (4, "3 4")]


def test_a_header_alone_is_refused(tmp_path):
    path = tmp_path / "cam1.prn"
    path.write_text(header("cam1.prn", (), height=12))
    with pytest.raises(VidtrackError, match="no points in it"):
        body_of(path, "points")

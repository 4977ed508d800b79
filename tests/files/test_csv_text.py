"""A file's text, separator and rows, in whatever form a program saved them."""

import csv
import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import VidtrackError
from vidtrack.files.csv_text import LONGEST_CELL, SEPARATORS, clean, read_text, short, split_rows

NAMES = ["tag", "x", "y"]
TEXT = "tag,x,y\nÄ1,1.5,2\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252"])
def test_a_text_is_the_same_in_every_encoding(tmp_path, encoding):
    (tmp_path / "t.csv").write_bytes(TEXT.encode(encoding))
    assert read_text(tmp_path / "t.csv") == TEXT


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"PK\x03\x04rest", "Excel or LibreOffice workbook"),
        (b"\xd0\xcf\x11\xe0rest", "an old Excel workbook"),
        (b"\x00\x01\x02\x03", "not a text file"),
        (b"tag,x\x07\n", "not a text file"),
    ],
)
def test_what_is_no_text_is_refused_by_what_it_is(tmp_path, data, says):
    (tmp_path / "t.csv").write_bytes(data)
    with pytest.raises(VidtrackError, match=says):
        read_text(tmp_path / "t.csv")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(VidtrackError, match="no such file"):
        read_text(tmp_path / "t.csv")
    with pytest.raises(VidtrackError, match="no file but a folder"):
        read_text(tmp_path)


cells = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=5).filter(
    lambda text: not text.startswith("#") and clean(text) == text and '"' not in text
)


@settings(max_examples=60)
@given(st.lists(st.tuples(cells, cells, cells), min_size=1, max_size=4), st.sampled_from(sorted(SEPARATORS)))
def test_rows_that_python_s_csv_writes_are_read_back(rows, separator):
    out = io.StringIO()
    csv.writer(out, delimiter=separator).writerows([NAMES, *rows])
    split = split_rows("t.csv", out.getvalue(), NAMES)
    assert split.separator == separator
    assert [tuple(row.cells) for row in split.rows[1:]] == rows
    assert [row.line for row in split.rows] == list(range(1, len(rows) + 2))


def test_the_separator_is_the_one_that_shows_the_names():
    assert split_rows("t", "written 1,2,3,4,5\ntag;x;y\n1;0,5;2\n", NAMES).separator == ";"
    assert split_rows("t", "sep=|\ntag|x|y\n", NAMES).separator == "|"
    assert split_rows("t", "# a,b,c\nno\tname\there\n", NAMES).separator == "\t"


def test_lines_are_counted_as_an_editor_counts_them():
    split = split_rows("t", 'sep=,\ntag,x\n\n# note\n"two\nlines",1\n3,4\n', NAMES)
    assert [(row.cells[0], row.line, row.marked) for row in split.rows] == [
        ("tag", 2, False),
        ("# note", 4, True),
        ("two\nlines", 5, False),
        ("3", 7, False),
    ]


def test_the_width_of_a_row_counts_the_empty_cells_at_its_end():
    (row,) = split_rows("t", "1,2,,\n", NAMES).rows
    assert row.cells == ["1", "2"]
    assert row.width == 4


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('tag,x\n1,"2\n3,4\n', "line 2: not CSV .*quotation mark is not closed"),
        ('tag,x\n1,"2"3\n', "line 2: not CSV"),
        ("tag,x\n1," + "9" * (LONGEST_CELL + 1) + "\n", f"line 2, column 2: a cell of {LONGEST_CELL + 1} characters"),
        ("tag,x\n1," + "9" * 200_000 + "\n", "line 2: not CSV .a cell of more than"),
    ],
)
def test_a_quotation_mark_or_a_cell_without_end_is_named_by_its_line(text, says):
    with pytest.raises(VidtrackError, match=says):
        split_rows("t.csv", text, NAMES)


def test_a_cell_of_the_greatest_length_is_read():
    assert split_rows("t", "tag,x\n" + "9" * LONGEST_CELL + ",1\n", NAMES).rows[1].cells[0] == "9" * LONGEST_CELL


def test_cells_are_cleaned_of_what_is_not_seen():
    assert clean("\ufeff\u00a0 a\u200bb\u202f ") == "ab"
    assert clean('="01"') == "01"


@given(st.text())
def test_a_message_shows_a_cell_on_one_line_and_short(cell):
    assert len(short(cell)) <= 60
    assert "\n" not in short(cell)

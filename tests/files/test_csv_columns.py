"""The row that names the columns is found below what instruments write, and what it lacks is said."""

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.csv_columns import POINTS, TARGETS, Columns, find_header, reference_record, unit_problems
from vidtrack.files.csv_text import split_rows


def header_of(text, columns=POINTS, others="forbid"):
    return find_header("t.csv", split_rows("t.csv", text, columns.names), columns, others)


def refused(text, columns=POINTS, others="forbid"):
    with pytest.raises(VidtrackError) as caught:
        header_of(text, columns, others)
    return list(caught.value.problems)


def test_a_header_below_titles_and_comments_is_found_and_the_rows_are_those_below_it():
    found = header_of("Survey of May\n# by hand\n\n# tag,x,y,z\n1,0,0,0\n")
    assert found.row.line == 4
    assert found.at == {"tag": 0, "x": 1, "y": 2, "z": 3}
    assert [row.line for row in found.rest] == [5]


def test_columns_are_found_in_any_order_and_notes_are_passed_over():
    found = header_of("Notes,z,Y (mm),x,tag,sigma\na,3,2,1,t,\n")
    assert found.at == {"z": 1, "y": 2, "x": 3, "tag": 4, "sigma": 5}
    assert found.units["y"] == "mm"


def test_a_row_of_units_below_the_header_is_no_row_of_values():
    found = header_of("tag,x,y,z\n,(mm),[mm],mm\n1,0,0,0\n")
    assert found.units == {"tag": "", "x": "mm", "y": "mm", "z": "mm"}
    assert [row.line for row in found.rest] == [3]
    assert len(header_of("tag,x,y,z\nmm,0,0,0\n").rest) == 1  # a tag called mm


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("# only a comment\n", "t.csv: empty"),
        ("1,2,3,4\n5,6,7,8\n", "line 1: the file begins with values"),
        ("tag,x,y\n", "line 1: no column z. The header must name tag,x,y,z."),
        ("tag,x,y,zet\n", "line 1: no column z"),
        ("tag,a,b,c\n", "line 1: no columns x, y, z; it names 'a', 'b', 'c'."),
        ("tag x y z\n1 2 3 4\n", "names no columns. Write tag,x,y,z, with commas"),
        ("tag,x,x,y,z\n", "line 1: column x appears twice. Keep one."),
        ("tag,x,X,y,z\n", "line 1: column x appears twice. Keep one."),
        ("tag,x,y,z,sigam\n", "no such column as 'sigam'; did you mean 'sigma'?"),
        ("tag,x,y,z,a,b,c,d\n", "4 columns that are not known, 'a', 'b', 'c' and 1 more."),
    ],
)
def test_what_a_header_lacks_or_has_too_much_is_one_line(text, says):
    lines = refused(text)
    assert len(lines) == 1
    assert says in lines[0]


def test_other_columns_may_be_ignored():
    assert header_of("time,v,other,v2\n", reference_record("time", "v"), "ignore").at == {"time": 0, "v": 1}
    assert header_of("V,v,time\n", reference_record("time", "v"), "ignore").at == {"v": 1, "time": 2}
    assert "twice" in refused("v,v,time\n", reference_record("time", "v"), "ignore")[0]


@pytest.mark.parametrize(
    ("text", "units", "says"),
    [
        ("tag,x (mm),y (mm),z\n", "in", "column 'x (mm)', 'y (mm)' is in mm, but config.yaml says units: in"),
        ("tag,x (s),y,z\n", "in", "is in s, which is no length"),
        ("tag,x (in),y,z\n", "in", None),
        ("tag,x (in),y,z\n", "", None),
        ("tag,x,y,z\n", "in", None),
        ("# units: mm\ntag,x,y,z\n", "in", "column 'x', 'y', 'z' is in mm"),
        ("Survey of May - all dimensions in metres\ntag,x (in),y,z\n", "in", "column 'y', 'z' is in m,"),
        ("coordinates (in)\ntag,x,y,z\n", "in", None),
        ("# units: mm\n# units: in\ntag,x,y,z\n", "in", None),  # which of them holds is not said
        ("# measured in May, sigma in mm\ntag,x,y,z\n", "in", None),
    ],
)
def test_a_unit_other_than_the_experiment_s_is_refused(text, units, says):
    problems = unit_problems("t.csv", header_of(text), POINTS, units)
    assert (says in problems[0] and len(problems) == 1) if says else problems == []


def test_pixels_are_no_millimetres():
    found = header_of("camera,target,Xf (mm),Yf\n", TARGETS)
    assert "vidtrack reads it in px" in unit_problems("t.csv", found, TARGETS, "in")[0]


def test_what_is_needed_is_what_is_not_optional():
    columns = Columns(("a",), ("b", "c"), optional=("c",))
    assert columns.names == ["a", "b", "c"]
    assert columns.needed == ["a", "b"]

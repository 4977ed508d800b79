import math
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from vidtrack.errors import VidtrackError
from vidtrack.files import csv_checked
from vidtrack.files.csv_checked import checked_csv, plain_columns
from vidtrack.files.csv_columns import CAMPAIGN, PICKS, POINTS, TARGETS, TRUTH, reference_record


def written(tmp_path, text, name="points.csv"):
    path = tmp_path / name
    path.write_text(text)
    return str(path)


def refusal(path, columns=POINTS):
    with pytest.raises(VidtrackError) as caught:
        checked_csv(path, columns)
    return str(caught.value).replace(path, "points.csv").splitlines()


def test_tags_stay_words_and_numbers_become_numbers(tmp_path):
    table = checked_csv(written(tmp_path, "tag,x,y,z\n07,1,2,3e1\nleft, 4 ,5,6\n"), POINTS)
    assert table["tag"] == ["07", "left"]
    assert table["z"] == [30.0, 6.0]
    assert table["line"] == [2, 3]


def test_columns_come_in_any_order_and_comments_and_blank_lines_do_not_count(tmp_path):
    table = checked_csv(written(tmp_path, "# survey of May\nz,y,x,tag\n\n3,2,1,a\n"), POINTS)
    assert (table["x"], table["z"], table["line"]) == ([1.0], [3.0], [4])


def test_a_byte_order_mark_from_a_spreadsheet_is_no_part_of_the_first_name(tmp_path):
    path = tmp_path / "points.csv"
    path.write_bytes("tag,x,y,z\na,1,2,3\n".encode("utf-8-sig"))
    assert checked_csv(str(path), POINTS)["tag"] == ["a"]


def test_an_empty_optional_cell_is_nan(tmp_path):
    table = checked_csv(written(tmp_path, "camera,target,Xf,Yf,width,height\nc,t,1,2,,---\n"), TARGETS)
    assert math.isnan(table["width"][0])
    assert math.isnan(table["height"][0])


def test_a_tag_named_twice_is_told_with_both_lines(tmp_path):
    path = written(tmp_path, "tag,x,y,z\n7,1,2,3\n8,1,2,3\n7,4,5,6\n")
    assert refusal(path) == ["points.csv, line 4: tag 7 appears twice (also line 2). Name each once."]


def test_every_bad_cell_is_told_with_its_line(tmp_path):
    lines = refusal(written(tmp_path, "tag,x,y,z\na,1,two,3\nb,,2,nan\n"))
    assert lines == [
        "points.csv, line 2: y is 'two', not a number. Write a number.",
        "points.csv, line 3: x is '', not a number. Write a number.",
        "points.csv, line 3: z is 'nan', not a number. Write a number.",
    ]


def test_a_misspelt_column_is_recognised(tmp_path):
    (line,) = refusal(written(tmp_path, "tgs,x,y,z\na,1,2,3\n"))
    assert "no column tag; is it 'tgs'?" in line
    (line,) = refusal(written(tmp_path, "tag,x,y,z,sigmma\na,1,2,3,4\n"))
    assert "no such column as 'sigmma'; did you mean 'sigma'?" in line


def test_a_row_with_too_few_cells_is_told(tmp_path):
    assert "line 2: 3 cells where the header names 4" in refusal(written(tmp_path, "tag,x,y,z\na,1,2\n"))[0]


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n", "tag,x,y,z\n"])
def test_a_file_without_rows_is_refused(tmp_path, text):
    assert len(refusal(written(tmp_path, text))) == 1


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "points.csv"
    path.write_bytes(bytes(range(128, 256)))
    assert "not a text file" in refusal(str(path))[0]


def test_a_missing_file_is_told_by_name(tmp_path):
    assert refusal(str(tmp_path / "none.csv"))[0].endswith("no such file. Put it there or correct its name.")


def test_many_problems_are_told_ten_at_a_time(tmp_path):
    lines = refusal(written(tmp_path, "tag,x,y,z\n" + "".join(f"t{i},a,1,1\n" for i in range(25))))
    assert len(lines) == 11
    assert "15 more" in lines[-1]


def read(tmp_path, data, columns=POINTS, units="in", others="forbid"):
    path = tmp_path / "points.csv"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    try:
        return checked_csv(str(path), columns, units=units, others=others)
    except VidtrackError as error:
        return str(error).replace(str(path), "points.csv")


@pytest.mark.parametrize(
    "data",
    [
        "tag;x;y;z\r\n1-1;1,5;-2;3,25\r\n",
        "sep=;\ntag;x;y;z\n1-1;1,5;-2;3,25\n",
        "tag\tx\ty\tz\n1-1\t1,5\t-2\t3,25\n",
        'tag,x,y,z\n1-1,"1,5","-2","3,25"\n',
        "Tag,X,Y,Z\r1-1,1.5,-2,3.25\r",
        'tag,X (in),Y [inch],z_in\n"1-1", 1.5,\u22122,\u00a03.25\u00a0\n',
        "tag,x,y,z,,\n1-1,1.5,-2,3.25,,\n,,,,,\n\n",
        "Survey of May\n\ntag,x,y,z\n,in,in,in\n1-1,1.5,-2,3.25\n",
        "# tag,x,y,z\n1-1,1.5,-2,3.25\n",
        "tag,x,y,z,Note\n1-1,1.5,-2,3.25,loose\n",
        'tag,x,y,z\n="1-1",1.5,-2,3.25\n',
        "tag|x|y|z\n1-1|1.5|-2|3.25\n",
        "tag,x,y,z\r\n1-1,1.5,-2,3.25\r\n\x1a",
        "tag;x;y;z\n1-1;1,5;-2;3,25\n".encode("utf-16"),
        "tag;x;y;z\n1-1;1,5;-2;3,25\n".encode("utf-16-be"),
        "tag;x;y;z;note\n1-1;1,5;-2;3,25;über 3 °\n".encode("cp1252"),
    ],
)
def test_what_is_unambiguous_is_read(tmp_path, data):
    table = read(tmp_path, data)
    assert isinstance(table, dict), table
    assert table["tag"] == ["1-1"]
    assert (table["x"], table["y"], table["z"]) == ([1.5], [-2.0], [3.25])


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (
            "tag\tx\ty\tz\n1\t1,250\t2,500\t3\n",
            "line 2: x is '1,250', and the comma may begin decimals or separate thou",
        ),
        ("tag;x;y;z\n1;1,5;2.5;3\n", "line 2: x is '1,5', and commas and points both begin decimals in this file"),
        ("tag,x,y,z\n1,1 000,2,3\n", "line 2: x is '1 000', not a number: it has marks between thousands"),
        ("tag;x;y;z\n1;1.234,5;2,1;3\n", "line 2: x is '1.234,5', not a number: it has marks between thousands"),
        ("tag,x,y,z\n1,1,2501,-2,5,3,0\n", "line 2: 7 cells where the header names 4. If commas begin decimals"),
        ("tag,x (mm),y,z\n1,1,2,3\n", "line 1: column 'x (mm)' is in mm, but config.yaml says units: in"),
        ("tag,x (s),y,z\n1,1,2,3\n", "line 1: column 'x (s)' is in s, which is no length"),
        ("tag,x,y,z\n,mm,mm,mm\n1,1,2,3\n", "column 'x', 'y', 'z' is in mm, but config.yaml says units: in"),
        ("tag,x,y,z,x\n1,1,2,3,4\n", "line 1: column x appears twice"),
        ("tag,x,y,z,X\n1,1,2,3,4\n", "line 1: column x appears twice"),
        ("tag,x,y,z\n1,1,2,3\n ,1,2,3\n", "line 3: tag is empty. Fill it in"),
        ("tag,x,y,z\n1,1,2,3\n#2,1,2,3\n", "line 3: '#2' may be a name, or the row a comment"),
        ("tag,x,y,z\n1,1_0,2,3\n", "line 2: x is '1_0', not a number"),
        ("tag,x,y,z\n1,2 mm,2,3\n", "line 2: x is '2 mm', not a number alone. Write 2"),
        ("tag,x,y,z\n1,#REF!,2,3\n", "an error of the spreadsheet"),
        ('tag,x,y,z\n"1,1,2,3\n', "line 2: not CSV (a quotation mark is not closed)"),
        ("1,1,2,3\n2,1,2,3\n", "line 1: the file begins with values, not with a header"),
        ("tag x y z\n1 1 2 3\n", "names no columns. Write tag,x,y,z, with commas"),
        ('"tag,x,y,z"\n"1,1,2,3"\n', "line 1: each line stands in quotation marks as a whole"),
        (
            "tag,x,y,z\n% the wall\n1,1,2,3\n",
            "line 2: 1 cell where the header names 4. If the line is a comment, begin",
        ),
        ("tag,x,y,z\n1,1e300,2,3\n", "line 2: x is '1e300', which no place has"),
        ("tag,x,y,z\n1,01.Mai,2,3\n", "line 2: x is '01.Mai', a date, which a spreadsheet may have made of a number"),
        ("tag;x;y;z\n1;1.234;2.500;3.000\n2;12;1.100;0\n", "the point may begin decimals or separate thousands"),
        ("tag,x,y,z,sigma\n1,1,2,3,-0.1\n", "line 2: sigma is '-0.1'; it must be 0 or greater"),
        ("tag,x,y,z\nleft  wall,1,2,3\nleft wall,4,5,6\n", "line 3: tag left wall appears twice (also line 2)"),
        ("tag,x,y,z\n\u00e9,1,2,3\ne\u0301,4,5,6\n", "line 3: tag \u00e9 appears twice (also line 2)"),
        ("tag,x,y,z\na\u00adb,1,2,3\nab,4,5,6\n", "line 3: tag ab appears twice (also line 2)"),
        ("tag,x,y,z,,\n1,1,2,3,,9\n", "line 2: 6 cells where the header names 4"),
        ("PK\x03\x04....", "points.csv: an Excel or LibreOffice workbook"),
        ("tag,x,y,z\n1," + "9" * 2000 + ",2,3\n", "line 2, column 2: a cell of 2000 characters"),
        ("tag,x,y,z\n1," + "9" * 10_000_000 + ",2,3\n", "line 2: not CSV (a cell of more than"),
        ("tag,x,y,z," + ",".join(f"c{n}" for n in range(9996)) + "\n", "line 1: 9996 columns that are not known"),
    ],
)
def test_what_is_not_is_one_line_that_names_the_place(tmp_path, data, says):
    told = read(tmp_path, data)
    assert isinstance(told, str), told
    assert says in told
    assert max(len(line) for line in told.splitlines()) < 400
    assert len(told.splitlines()) == 1


def test_tags_that_begin_with_a_number_sign_are_tags_where_no_other_row_is(tmp_path):
    assert read(tmp_path, "tag,x,y,z\n#1,1,2,3\n#2,4,5,6\n# the end\n")["tag"] == ["#1", "#2"]
    assert read(tmp_path, 'tag,x,y,z\n"#1",1,2,3\n01,4,5,6\n# 3,1,1,1\n')["tag"] == ["#1", "01"]


def test_times_keep_their_words_and_their_decimals_become_points(tmp_path):
    told = read(tmp_path, "time_s;x_in\n0,033;1,5\n0,066;NaN\n", reference_record("time_s", "x_in"), others="ignore")
    assert told["time_s"] == ["0.033", "0.066"]
    assert told["x_in"][0] == 1.5
    assert math.isnan(told["x_in"][1])


@given(st.binary(max_size=300) | st.text(alphabet='tagxyz#,;\t"=.0123456789-\n\r \x00é', max_size=200).map(str.encode))
@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_read_or_refused_in_short_lines(tmp_path, data):
    told = read(tmp_path, b"tag,x,y,z\n" + data)
    if isinstance(told, str):
        assert told
        assert all(len(line) < 400 for line in told.splitlines())
    else:
        assert all(math.isfinite(value) for axis in "xyz" for value in told[axis])


@given(st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), min_size=1, max_size=8), st.sampled_from(";\t|"))
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_decimal_comma_is_read_as_what_was_written_or_refused(tmp_path, rows, separator):
    lines = [separator.join([str(n), *(f"{v:.4f}".replace(".", ",") for v in row)]) for n, row in enumerate(rows)]
    told = read(tmp_path, "\n".join([separator.join(["tag", "x", "y", "z"]), *lines]))
    assert told["x"] == [float(f"{row[0]:.4f}") for row in rows]


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ("time_s,x_in\nms,in\n1,2\n", "'time_s' is in ms, and vidtrack reads it in s"),
        ("time_s,x_in\ns,mm\n1,2\n", "'x_in' is in mm, but config.yaml says units: in"),
        ("time_s,x_in\ns,V\n1,2\n", None),
    ],
)
def test_units_below_the_header_of_a_reference_are_compared_too(tmp_path, data, says):
    answer = read(tmp_path, data, reference_record("time_s", "x_in"), others="ignore")
    assert (says in answer) if says else (isinstance(answer, str) and "line 2" in answer)


def test_a_name_that_has_another_unit_of_time_in_itself_is_refused(tmp_path):
    answer = read(tmp_path, "time_ms,v\n0,2\n5,3\n", reference_record("time_ms", "v"), others="ignore")
    assert "'time_ms' is in ms, and vidtrack reads it in s" in answer


@pytest.mark.parametrize(
    ("columns", "row", "says"),
    [
        (TARGETS, "camera,target,Xf,Yf,width,height\nc,a,1,1,0,5\n", "width is '0'; it must be greater than 0"),
        (CAMPAIGN, "run,H,T\na,1,-2\n", "T is '-2'; it must be greater than 0"),
        (PICKS, "camera,tag,Xf,Yf,sd\nc,1,1,1,0\n", "sd is '0'; it must be greater than 0"),
    ],
)
def test_a_size_or_a_period_that_cannot_be_is_refused(tmp_path, columns, row, says):
    assert says in read(tmp_path, row, columns)


def _answer_cell_by_cell(path):
    with patch.object(csv_checked, "plain_columns", return_value=None):
        try:
            return checked_csv(path, TRUTH)
        except VidtrackError as error:
            return error.problems


@given(
    st.lists(st.tuples(st.integers(0, 3), st.floats(-1e7, 1e7)), min_size=1, max_size=5),
    st.integers(0, 90),
    st.sampled_from(["", "", ",", "\n", "#", "1", "e", "-", '"', " ", "a\u0301", ".", "9" * 14, ",,", "\r"]),
)
@example([(0, 0.0)], 49, "1")  # a last row that is not whole
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_table_as_programs_write_it_is_read_sooner_and_the_same(tmp_path, rows, place, put):
    lines = ["time_s,target,x,y,z", *(f"{at:.2f},t{n},{at:.9f},{-at:.3f},{n}" for n, at in rows)]
    text = "\n".join(lines) + "\n"
    text = text[:place] + put + text[place:]
    (path := tmp_path / "truth.csv").write_bytes(text.encode())
    answer = plain_columns(text, TRUTH)
    if answer is not None:
        assert answer == _answer_cell_by_cell(path)
        assert list(answer) == ["target", "time_s", "x", "y", "z", "line"]


def test_a_table_as_programs_write_it_is_known_for_one():
    head, row = "time_s,target,x,y,z\n", "36000.000000000,t1,20.000000000,0.000000000,-1\n"
    assert plain_columns(head + row, TRUTH)["x"] == [20.0]
    for other in (head + row + row, head, row, head + row[:-1], head.replace("z", "Z") + row):
        assert plain_columns(other, TRUTH) is None

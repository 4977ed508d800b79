import math

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.csv_checked import checked_csv
from vidtrack.files.csv_columns import POINTS, TARGETS


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
    table = checked_csv(written(tmp_path, "camera,target,Xf,Yf,width,height\nc,t,1,2,,\n"), TARGETS)
    assert math.isnan(table["width"][0])


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

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.table import cells_of, numbers_of, separator_of, split


@pytest.mark.parametrize(("line", "mark"), [("a,b", ","), ("a;b;c,d", ";"), ("a\tb", "\t"), ("a b", " ")])
def test_the_separator_is_the_commonest_mark_of_the_header(line, mark):
    assert separator_of(line) == mark
    assert cells_of(line, mark)[0] == "a"


def test_columns_are_read_quickly_and_slowly_to_the_same_numbers():
    rng = np.random.default_rng(0)
    values = np.round(rng.normal(0, 1000, (50, 4)), 6)
    values[3, 2] = np.nan
    rows = "\n".join(",".join("" if v != v else f"{v:.6f}" for v in row) for row in values)
    _, quick = split("a,b,c,d\n" + rows + "\n")
    _, slow = split(("a,b,c,d\n" + rows).replace(",", ";").replace(".", ","))
    for table in (quick, slow):
        np.testing.assert_array_equal(numbers_of("x.csv", table, [2, 0]), values[:, [2, 0]])


def test_a_bad_cell_is_named_by_its_line_in_the_file():
    _, table = split("\n\na,b\n1,2\n3,x\n")
    with pytest.raises(VidtrackError, match=r"x\.csv, line 5: 'x' in column 2"):
        numbers_of("x.csv", table, [0, 1])


@pytest.mark.parametrize("text", ["sep=;\na;b\n1,5;2\n", "a,b,\n1.5,2,\n", "a,b\r\n1.5,2\r\n", '"a","b"\n"1.5","2"\n'])
def test_tables_as_a_spreadsheet_saves_them_are_read(text):
    _, table = split(text.replace("\r\n", "\n"))
    np.testing.assert_array_equal(numbers_of("x.csv", table, [0, 1]), [[1.5, 2]])


@pytest.mark.parametrize("row", ["3", "3,4,5", "1,5,2,5", "3,4,"])
def test_a_row_of_another_length_is_named_wherever_it_is(row):
    _, table = split(f"a,b\n1,2\n{row}\n5,6\n")
    if row == "3,4,":  # nothing behind the last comma
        assert numbers_of("x.csv", table, [0, 1]).tolist() == [[1, 2], [3, 4], [5, 6]]
        return
    with pytest.raises(VidtrackError, match=r"x\.csv, line 3: \d cells where the header has 2"):
        numbers_of("x.csv", table, [0, 1])

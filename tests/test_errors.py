from vidtrack.errors import VidtrackError, first_of


def test_problems_beyond_the_tenth_of_a_kind_are_counted():
    assert first_of(["a"] * 10, "f.csv") == ["a"] * 10
    assert first_of(["a"] * 47, "f.csv") == [*["a"] * 10, "f.csv: and 37 more problems like these."]


def test_of_very_many_problems_the_rest_is_counted():
    error = VidtrackError(*map(str, range(500)))
    assert error.problems[:2] == ("0", "1")
    assert error.problems[-1] == "and 440 more problems."
    assert str(error).count("\n") == 60


def test_a_problem_is_one_line_and_moves_no_cursor_whatever_stands_in_a_name():
    error = VidtrackError("config.yaml: a\x1b[31m\nvidtrack: all good\u2028\u202e\ud800: no such setting.")
    (line,) = error.problems
    assert line == r"config.yaml: a\x1b[31m\nvidtrack: all good\u2028\u202e\ud800: no such setting."
    assert str(error).encode().isascii()


def test_of_a_very_long_problem_beginning_and_cure_are_shown():
    (line,) = VidtrackError(f"points.csv: {'x' * 5_000_000} is no number. Write a number.").problems
    assert len(line) < 2100
    assert line.startswith("points.csv: xxx")
    assert line.endswith("xxx is no number. Write a number.")

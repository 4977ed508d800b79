from vidtrack.errors import VidtrackError, first_of


def test_problems_beyond_the_tenth_of_a_kind_are_counted():
    assert first_of(["a"] * 10, "f.csv") == ["a"] * 10
    assert first_of(["a"] * 47, "f.csv") == [*["a"] * 10, "f.csv: and 37 more problems like these."]


def test_of_very_many_problems_the_rest_is_counted():
    error = VidtrackError(*map(str, range(500)))
    assert error.problems[:2] == ("0", "1")
    assert error.problems[-1] == "and 440 more problems."
    assert str(error).count("\n") == 60

import pytest

from vidtrack.naming import did_you_mean, some_of, tags_meant

NUMBERED = [str(n) for n in range(1, 17)]


def test_the_nearest_known_name_is_found_and_a_far_one_is_not():
    assert did_you_mean("treshold", ["polarity", "threshold"]) == "threshold"
    assert did_you_mean("CAM1", ["cam1"]) == "cam1"
    assert did_you_mean("elephant", ["cam1"]) is None


@pytest.mark.parametrize(
    ("parts", "known", "meant"),
    [
        (["1-4"], NUMBERED, "1 2 3 4"),
        (["3", "7-8", "left"], [*NUMBERED, "left"], "3 7 8 left"),
        (["1-1", "2-1"], ["1-1", "1-2", "2-1", "2-2"], "1-1 2-1"),
        (["2-1", "3-4"], ["2-1", "3", "4"], "2-1 3 4"),
        (["1-3"], ["01", "02", "03"], "01 02 03"),
        (["01-03"], ["01", "02", "03"], "01 02 03"),
        (["8-10"], ["08", "09", "10"], "08 09 10"),
        (["A1-A3"], ["A1", "A2", "A3"], "A1 A2 A3"),
        (["#1", "#2-#3"], ["#1", "#2", "#3"], "#1 #2 #3"),
        (["1-2"], [], "1 2"),
    ],
)
def test_a_tag_of_the_points_stands_as_it_is_and_all_else_is_a_range(parts, known, meant):
    assert tags_meant(parts, known) == (meant.split(), [])


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ("16-1", "16-1 is no tag in points.csv, and as a range it counts backwards. Correct it, or write 1-16."),
        ("20-30", "20-30 is no tag in points.csv, and neither are 20 to 30. Correct it."),
        ("1-999999999", "more than 10000 tags"),
    ],
)
def test_a_range_that_cannot_be_is_one_sentence(part, says):
    tags, (problem,) = tags_meant([part], NUMBERED)
    assert tags == []
    assert says in problem


def test_names_beyond_the_first_are_counted():
    assert some_of(NUMBERED[:12]) == ", ".join(NUMBERED[:12])
    assert some_of(NUMBERED) == "1, 2, 3, 4, 5, 6, 7, 8, 9, 10 and 6 more"

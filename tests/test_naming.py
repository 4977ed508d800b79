import pytest

from vidtrack.naming import chapter_of, did_you_mean, hint_of, in_order, numbered_like, some_of, tags_meant

NUMBERED = [str(n) for n in range(1, 17)]


def test_the_nearest_known_name_is_found_and_a_far_one_is_not():
    assert did_you_mean("treshold", ["polarity", "threshold"]) == "threshold"
    assert did_you_mean("CAM1", ["cam1"]) == "cam1"
    assert did_you_mean("elephant", ["cam1"]) is None


def test_what_begins_with_a_known_name_and_goes_on_otherwise_is_of_that_name():
    assert did_you_mean("cam1-2", ["cam1", "cam2"]) == "cam1"
    assert did_you_mean("Cam1 (2)", ["cam1", "cam2"]) == "cam1"
    assert did_you_mean("cam12", ["cam1", "east"]) == "cam1"


def test_a_name_that_looks_the_same_is_said_to_be_stored_otherwise():
    assert hint_of("b\u00e4r", ["ba\u0308r"], "none") == (
        "'ba\u0308r' has the same letters, stored otherwise (accents as a Mac stores them, or spaces). Rename it."
    )
    assert hint_of("bar", ["bat"], "none") == "did you mean 'bat'?"
    assert hint_of("bar", ["elephant"], "none") == "none"


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
        (["13–16"], NUMBERED, "13 14 15 16"),
        (["3 to 5", "7..9"], NUMBERED, "3 4 5 7 8 9"),
        (["3 4 9"], NUMBERED, "3 4 9"),
        (["3 4 left"], NUMBERED, None),
    ],
)
def test_a_tag_of_the_points_stands_as_it_is_and_all_else_is_a_range(parts, known, meant):
    assert tags_meant(parts, known) == (meant.split() if meant else parts, [])


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ("16-1", "16-1 is no tag in points.csv, and as a range it counts backwards. Correct the tag, or write 1-16."),
        ("20-30", "20-30 is no tag in points.csv, and neither are 20 to 30. Correct the range."),
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


def test_numbered_names_are_found_by_the_number_before_their_ending_and_sorted_by_it():
    names = ["img_2.png", "img_10.PNG", "img_1.png", "img_1.tif", "other_3.png", "img_x.png", "img_2b.png"]
    assert numbered_like("img_1.png", names) == [(1, "img_1.png"), (2, "img_2.png"), (10, "img_10.PNG")]
    assert numbered_like("2024-05-01_007.bmp", ["2024-05-01_007.bmp", "2024-05-02_008.bmp"]) == [
        (7, "2024-05-01_007.bmp")
    ]
    assert numbered_like("img.png", names) == []


def test_chapters_come_after_each_other_and_ten_after_nine():
    assert in_order(["GX020001.MP4", "GX010002.MP4", "GX010001.MP4"]) == [
        "GX010001.MP4",
        "GX020001.MP4",
        "GX010002.MP4",
    ]
    assert in_order(["a10.mts", "a9.mts", "b1.mts", "1.mts"]) == ["1.mts", "a9.mts", "a10.mts", "b1.mts"]
    assert chapter_of("GOPR0042.MP4") == ("0042", 0)
    assert chapter_of("GP010042.MP4") == ("0042", 1)
    assert chapter_of("cam1.mov") is None

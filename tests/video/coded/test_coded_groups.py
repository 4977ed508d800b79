from vidtrack.video.coded.coded_groups import Coded, looks_at


def groups(*times: list[int]) -> list[list[Coded]]:
    return [[Coded(pts, pts) for pts in group] for group in times]


def called(looks) -> list[tuple[int, list[int], list[int]]]:
    return [(look.coded.pts, [one.pts for one in look.control], [one.pts for one in look.after]) for look in looks]


def test_of_a_picture_its_key_frame_is_looked_at_then_itself_beside_those_before_it_in_the_order_of_coding():
    two = groups([0, 1, 2], [3, 4, 5])
    assert called(looks_at(two, range(2), [5])) == [(3, [0], []), (5, [3, 4], [])]


def test_of_a_picture_shown_before_another_that_is_coded_first_that_one_is_looked_at_too():
    one = groups([0, 3, 1, 2])
    assert [look.coded.pts for look in looks_at(one, range(1), [1])] == [0, 3, 1]


def test_at_a_key_frame_the_one_before_is_looked_at_since_what_was_damaged_until_then_comes_back():
    two = groups([0, 1], [2, 3])
    assert called(looks_at(two, range(2), [2])) == [(0, [2], [2, 3]), (2, [0], [])]


def test_groups_that_are_not_looked_at_and_other_pictures_make_no_look():
    assert not list(looks_at(groups([0, 1], [2, 3]), range(1), [3, 7]))

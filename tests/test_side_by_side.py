import threading

import pytest

from vidtrack import side_by_side as room
from vidtrack.side_by_side import both, side_by_side


@pytest.fixture(params=[1, 8])
def cores(request, monkeypatch):
    monkeypatch.setattr(room.os, "cpu_count", lambda: request.param)
    return request.param


def test_each_part_gives_its_own_result_in_its_own_place(cores):
    assert side_by_side(lambda part: part * part, range(20)) == [k * k for k in range(20)]
    assert side_by_side(lambda part: part, []) == []


def test_two_parts_are_worked_on_at_the_same_time_where_there_are_two_cores(monkeypatch):
    monkeypatch.setattr(room.os, "cpu_count", lambda: 2)
    there = threading.Barrier(2, timeout=10)
    assert len({*side_by_side(lambda part: (there.wait(), part), [1, 2])}) == 2
    assert {*both(there.wait, there.wait)} == {0, 1}


def test_what_a_part_raises_is_raised(cores):
    def refuse(part):
        raise KeyError(part)

    with pytest.raises(KeyError):
        side_by_side(refuse, [1, 2, 3])


def test_two_works_give_what_they_give_and_raise_what_they_raise(cores):
    assert both(lambda: 1, lambda: "two") == (1, "two")
    for one, other in (({}.popitem, int), (int, {}.popitem)):
        with pytest.raises(KeyError):
            both(one, other)

import os

import pytest

from vidtrack.video.processes import looks_beside
from vidtrack.video.processes.looks_beside import LooksBeside
from vidtrack.video.processes.read_apart import CAN_FORK

forks = pytest.mark.skipif(not CAN_FORK, reason="processes are not forked here")


@forks
def test_every_other_picture_is_looked_at_by_another_process():
    beside = LooksBeside([5, 3, 8, 1, 9], lambda picture: (10 * picture, os.getpid()), "a.mp4")
    assert [beside.at(picture) for picture in (5, 8, 9)] == [None] * 3
    assert [beside.at(picture)[0] for picture in (3, 1, 3)] == [30, 10, 30]
    assert beside.at(3)[1] != os.getpid()
    beside.close()


def test_once_it_is_closed_nothing_is_known():
    beside = LooksBeside(range(6), str, "a.mp4")
    beside.close()
    assert beside.at(1) is None


@forks
def test_what_a_look_raises_is_raised_here():
    beside = LooksBeside(range(6), lambda picture: 1 // (picture - 1), "a.mp4")
    with pytest.raises(ZeroDivisionError):
        beside.at(1)
    beside.close()


@pytest.mark.parametrize("why", ["few", "no fork", "no process"])
def test_where_there_is_no_other_process_nothing_is_looked_at(monkeypatch, why):
    def none(*_):
        raise OSError

    monkeypatch.setattr(looks_beside, "CAN_FORK", why != "no fork")
    if why == "no process":
        monkeypatch.setattr(looks_beside, "ReadApart", none)
    beside = LooksBeside(range(4 if why == "few" else 6), str, "a.mp4")
    assert beside.at(1) is None
    beside.close()

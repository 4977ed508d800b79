import itertools
import os
import signal
import time
from select import select

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.video.processes.read_apart import CAN_FORK, LEAST, MOST, ReadApart

pytestmark = pytest.mark.skipif(not CAN_FORK, reason="there is no fork here")

SHAPE = (6, 5)


def picture(i):
    return np.full(SHAPE, i, np.uint16) + np.arange(30, dtype=np.uint16).reshape(SHAPE)


def apart(items, memory=1 << 16):
    return ReadApart(lambda: items, SHAPE, np.uint16, memory, "tape.dv")


@pytest.mark.parametrize("memory", [0, 1 << 16, 1 << 30])
def test_everything_comes_in_order_and_pictures_may_be_held(memory):
    items = [(None, "begun"), *((picture(i), i) for i in range(400)), (None, "ended")]
    reader = apart(items, memory)
    seen = list(reader)
    reader.close()
    assert [what for _, what in seen] == [what for _, what in items]
    assert seen[0][0] is seen[-1][0] is None
    for luma, i in seen[1:-1]:
        np.testing.assert_array_equal(luma, picture(i))
        assert not luma.flags.writeable


def test_pictures_of_another_kind_come_too():
    items = [(np.arange(6.0), 0), (picture(1), 1), (np.zeros(SHAPE, np.uint8), 2), (picture(3)[::-1], 3)]
    reader = apart(items)
    for (luma, i), (expected, k) in zip(reader, items, strict=True):
        assert i == k
        assert luma.dtype == expected.dtype
        np.testing.assert_array_equal(luma, expected)
    reader.close()


def test_a_field_of_a_picture_keeps_its_place():
    reader = apart(((picture(i), i) for i in range(50)), memory=0)
    fields = [luma[i % 2 :: 2][:2] for luma, i in reader]
    for i, field in enumerate(fields):
        np.testing.assert_array_equal(field, picture(i)[i % 2 :: 2][:2])
    reader.close()


def test_places_are_used_again():
    reader = apart(((picture(i), i) for i in range(300)), memory=1 << 30)
    assert reader._ring.places == MOST
    addresses = set()
    for luma, i in reader:
        time.sleep(0.001 * (i < 50))
        addresses.add(luma.ctypes.data)
    reader.close()
    assert len(addresses) < 300
    reader = apart([], memory=0)
    assert reader._ring.places == LEAST
    reader.close()


@pytest.mark.parametrize("error", [VidtrackError("tape.dv: torn. Mend it."), OSError(5, "tape torn")])
def test_what_the_reading_raises_comes_after_what_was_read(error):
    def broken():
        yield picture(1), 1
        yield picture(2), 2
        raise error

    seen, reader = [], apart(broken())
    with pytest.raises(type(error)) as raised:
        for _, i in reader:
            seen.append(i)
    assert seen == [1, 2]
    assert str(raised.value) == str(error)
    reader.close()


def test_an_error_that_cannot_be_sent_is_told_in_words():
    def broken():
        raise ValueError(lambda: None)
        yield

    reader = apart(broken())
    with pytest.raises(RuntimeError, match="ValueError: <function"):
        list(reader)
    reader.close()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_is_killed_is_a_problem_of_one_line(how):
    def endless():
        yield picture(0), 0
        time.sleep(60)

    reader = apart(endless(), memory=0)
    os.kill(reader._process, how)
    with pytest.raises(VidtrackError, match=rf"tape\.dv: the process that decodes it was killed \({how.name}\)"):
        list(reader)


def test_closing_ends_the_process_and_pictures_stay():
    reader = apart((picture(i), i) for i in range(10_000))
    process = reader._process
    luma, _ = next(iter(reader))
    reader.close()
    reader.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    np.testing.assert_array_equal(luma, picture(0))


def test_no_process_outlives_the_one_that_it_reads_for():
    told, tell = os.pipe()
    parent = os.fork()
    if not parent:
        reader = apart((picture(i), i) for i in itertools.count())
        next(iter(reader))
        os.write(tell, str(reader._process).encode())
        time.sleep(60)
        os._exit(0)
    process = os.pidfd_open(int(os.read(told, 20)))
    assert select([process], [], [], 0) == ([], [], [])
    os.kill(parent, signal.SIGKILL)
    os.waitpid(parent, 0)
    assert select([process], [], [], 10)[0], "it still runs"
    os.close(process)


def test_a_system_that_refuses_a_process_is_an_error_and_nothing_stays_open(monkeypatch):
    def refused():
        raise BlockingIOError(11, "Resource temporarily unavailable")

    before = os.listdir("/proc/self/fd")
    monkeypatch.setattr(os, "fork", refused)
    with pytest.raises(OSError, match="unavailable"):
        apart([])
    assert os.listdir("/proc/self/fd") == before

import threading

import pytest

from vidtrack.video.processes.read_ahead import HANDED, read_ahead


@pytest.mark.parametrize("n", [0, 1, HANDED, 4 * HANDED + 1])
def test_everything_comes_in_order(n):
    assert list(read_ahead(range(n), 8)) == list(range(n))


def test_what_the_reading_raises_comes_after_what_was_read():
    def broken():
        yield 1
        yield 2
        raise OSError("tape torn")

    seen = []
    with pytest.raises(OSError, match="tape torn"):
        for item in read_ahead(broken(), 8):
            seen += [item]
    assert seen == [1, 2]


def test_giving_up_early_ends_the_thread():
    before = threading.active_count()
    items = read_ahead(iter(range(1000)), 8)
    next(items)
    assert threading.active_count() == before + 1
    items.close()
    assert threading.active_count() == before


@pytest.mark.parametrize("most", [2, 8, 40])
def test_reading_keeps_only_so_many_ahead(most):
    read = []

    def items():
        for i in range(1000):
            read.append(i)
            yield i

    reading = read_ahead(items(), most)
    next(reading)
    threading.Event().wait(0.1)
    assert most <= len(read) <= most + 2 * min(HANDED, most // 2)
    reading.close()

import threading

import pytest

from vidtrack.tracking.read_ahead import batches_ahead


def test_everything_comes_in_order():
    batches = list(batches_ahead(range(10), 4))
    assert batches == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    assert list(batches_ahead([], 4)) == []


def test_what_the_reading_raises_comes_after_what_was_read():
    def broken():
        yield 1
        yield 2
        raise OSError("tape torn")

    seen = []
    with pytest.raises(OSError, match="tape torn"):
        for batch in batches_ahead(broken(), 1):
            seen += batch
    assert seen == [1, 2]


def test_giving_up_early_ends_the_thread():
    before = threading.active_count()
    batches = batches_ahead(iter(range(1000)), 1)
    next(batches)
    batches.close()
    assert threading.active_count() == before


def test_reading_keeps_only_a_few_batches_ahead():
    read = []

    def items():
        for i in range(100):
            read.append(i)
            yield i

    batches = batches_ahead(items(), 2, waiting=2)
    next(batches)
    threading.Event().wait(0.1)
    assert len(read) <= 2 * 5
    batches.close()

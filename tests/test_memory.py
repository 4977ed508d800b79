import ctypes
import gc
import platform
import subprocess
import sys

import numpy as np
import pandas as pd
import psutil
import pyarrow as pa
import pytest

from vidtrack.memory import collector_paused, columns_of, give_back_memory, keep_freed_memory, tables_from_c_library


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="malloc_trim is a function of glibc")
def test_what_was_freed_below_something_that_stays_is_given_back():
    pieces = [bytes(4000) for _ in range(10_000)]
    last, used = pieces[-1], psutil.Process().memory_info().rss
    del pieces
    give_back_memory()
    assert used - psutil.Process().memory_info().rss > 20_000_000
    assert len(last) == 4000


KEPT = """
import numpy as np, psutil
from vidtrack.memory import give_back_memory, keep_freed_memory

def used():
    return psutil.Process().memory_info().rss

keep_freed_memory({most})
before = used()
arrays = [np.ones(500_000) for _ in range(10)]
arrays.clear()
kept = used() - before
give_back_memory()
print(kept, used() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is a function of glibc")
@pytest.mark.parametrize("most", [0, 64_000_000])
def test_so_much_of_what_was_freed_stays_until_it_is_given_back(most):
    printed = subprocess.run([sys.executable, "-c", KEPT.format(most=most)], capture_output=True, text=True, check=True)
    kept, given_back = (int(word) for word in printed.stdout.split())
    assert (kept > 35_000_000) == (most > 0)
    assert given_back < 5_000_000


@pytest.mark.parametrize("error", [OSError, TypeError, AttributeError])
def test_another_library_is_left_alone(monkeypatch, error):
    def refuse(name):
        raise error("no such library")

    monkeypatch.setattr(ctypes, "CDLL", refuse)
    give_back_memory()
    keep_freed_memory(1)


def test_the_collector_is_as_it_was_after_a_pause_that_ends_in_an_error_or_not():
    for before in (False, True):
        gc.enable() if before else gc.disable()
        try:
            with collector_paused():
                assert not gc.isenabled()
            assert gc.isenabled() == before
            with pytest.raises(KeyError), collector_paused():
                raise KeyError
            assert gc.isenabled() == before
        finally:
            gc.enable()


def test_words_of_a_table_are_held_once_and_are_those_that_pandas_gives():
    code, flag = np.repeat([f"10:00:00:{k:02d}" for k in range(9)], 3), ["", "edge", None] * 9
    table = pd.DataFrame({"t": np.arange(27.0), "code": code, "flag": flag, "n": np.arange(27)})
    found = columns_of(table)
    for name, values in found.items():
        pd.testing.assert_series_equal(pd.Series(values), pd.Series(table[name].to_numpy()))
    assert (
        len({id(word) for word in found["code"].tolist()}) == 9 < len({id(word) for word in table["code"].to_numpy()})
    )
    assert list(columns_of(table, ("t", "flag"))) == ["t", "flag"]
    assert {name: values.size for name, values in columns_of(table[:0]).items()} == dict.fromkeys(table, 0)


def test_words_of_tables_lie_where_what_is_freed_can_be_given_back_with_all_else():
    before = pa.default_memory_pool()
    try:
        tables_from_c_library()
        used = pa.system_memory_pool().bytes_allocated()
        words = pd.Series(np.array(["top", "bottom"], object)).array.take(np.arange(100_000) % 2)
        assert pa.system_memory_pool().bytes_allocated() - used > 100_000 * 8
        assert list(words[:3]) == ["top", "bottom", "top"]
    finally:
        pa.set_memory_pool(before)


AHEAD = """
import numpy, psutil
from vidtrack.memory import PagesAhead

def used():
    return psutil.Process().memory_info().rss

before = used()
ahead = PagesAhead({each}, 20_000_000)
made = used() - before
for _ in range(100):
    ahead.touch(1)
touched = used() - before
ahead.touch(10_000)
del ahead
print(made, touched, used() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is a function of glibc")
@pytest.mark.parametrize(("each", "least"), [(100_000, 10_000_000), (1000, 0)])
def test_pages_are_there_ahead_as_samples_pass_and_stay(each, least):
    printed = subprocess.run(
        [sys.executable, "-c", AHEAD.format(each=each)], capture_output=True, text=True, check=True
    )
    made, touched, kept = (int(word) for word in printed.stdout.split())
    assert made < 5_000_000
    assert least <= touched < least + 5_000_000
    assert (kept > 15_000_000) == (least > 0)

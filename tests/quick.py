"""A plugin of pytest for `bash setup.sh test quick`: the tests that take next to nothing, in several processes.

What is left out is in tests/left_out_of_quick.txt; tests/processor_time.py measures it. With --part 1/2 every second
file is collected, so that each process imports its own files alone.
"""

import zlib
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
LEFT_OUT = frozenset((TESTS / "left_out_of_quick.txt").read_text().split())
NEVER = ("tests/whole_workflow",)


def pytest_addoption(parser):
    parser.addoption("--part", default="1/1", help="which part of the files, of how many")


def is_in(path: str, part: str) -> bool:
    """Whether a file of tests is in a part such as 1/2."""
    this, of = map(int, part.split("/"))
    return zlib.crc32(path.encode()) % of == this - 1


def pytest_ignore_collect(collection_path, config):
    if not collection_path.is_relative_to(TESTS):
        return None
    path = collection_path.relative_to(TESTS.parent).as_posix()
    if path in NEVER or path in LEFT_OUT:
        return True
    if collection_path.suffix == ".py" and not is_in(path, config.getoption("--part")):
        return True
    return None


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    kept, out = [], []
    for item in items:
        left = item.get_closest_marker("slow") or item.nodeid.split("[")[0] in LEFT_OUT
        (out if left else kept).append(item)
    config.hook.pytest_deselected(items=out)
    items[:] = kept

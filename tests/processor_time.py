"""A plugin of pytest: the processor time of each test, and the 30 dearest, whatever else the machine does meanwhile.

python -m pytest -p no:xdist -p tests.processor_time -m "not slow" tests/calibration
"""

import os

import pytest

MOST = 30
_spent: dict[str, float] = {}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    before = sum(os.times()[:4])
    result = yield
    _spent[item.nodeid] = sum(os.times()[:4]) - before
    return result


def pytest_terminal_summary(terminalreporter):
    terminalreporter.section(f"processor time, {sum(_spent.values()):.1f} s in all")
    for name in sorted(_spent, key=_spent.__getitem__, reverse=True)[:MOST]:
        terminalreporter.write_line(f"{_spent[name]:7.2f} s  {name}")

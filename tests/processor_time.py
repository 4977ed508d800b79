"""A plugin of pytest: the processor time of each test, and the 30 dearest, whatever else the machine does meanwhile.

python -m pytest -p no:xdist -p tests.processor_time -m "not slow" tests/calibration

With --leave-out 0.1 the test functions of these files that take more, all their cases together, become their lines in
tests/left_out_of_quick.txt; a file of which nothing is left becomes one line.
"""

import os
import re
from collections import defaultdict
from pathlib import Path

import pytest

MOST = 30
LEFT_OUT = Path(__file__).with_name("left_out_of_quick.txt")
_spent: dict[str, float] = {}


def pytest_addoption(parser):
    parser.addoption("--leave-out", type=float, help="seconds from which a test function is left out of quick")


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
    limit = terminalreporter.config.getoption("--leave-out")
    if limit is not None:
        old = LEFT_OUT.read_text().split() if LEFT_OUT.exists() else []
        LEFT_OUT.write_text("\n".join(left_out(_spent, limit, old)) + "\n")


def left_out(spent, limit, old=()):
    """The lines of LEFT_OUT: functions that were measured anew, all others as they are."""
    functions = defaultdict(float)
    for name, seconds in spent.items():
        functions[re.sub(r"\[.*", "", name)] += seconds
    files = defaultdict(list)
    for name in functions:
        files[name.split("::")[0]].append(name)
    lines = [line for line in old if line not in functions and line not in files]
    for path, names in files.items():
        dear = [name for name in names if functions[name] > limit]
        if dear == names:
            lines = [line for line in lines if line.split("::")[0] != path]
        lines += [path] if dear == names else dear
    return sorted(lines)

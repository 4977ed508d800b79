"""What `bash setup.sh test quick` leaves out exists, and every room keeps tests in it."""

import re
from functools import cache
from pathlib import Path

from tests.processor_time import left_out
from tests.quick import LEFT_OUT, NEVER, is_in

REPO = Path(__file__).parents[1]


@cache
def functions(path: Path) -> list[str]:
    name = path.relative_to(REPO).as_posix()
    return [f"{name}::{test}" for test in re.findall(r"^def (test_\w+)", path.read_text(), re.MULTILINE)]


def test_nearly_all_that_is_left_out_exists():
    """A test that was renamed is in quick until it is measured again; many of them need a new list."""
    here = {name for path in (REPO / "tests").rglob("test_*.py") for name in (*functions(path), path.as_posix())}
    here = {name.removeprefix(f"{REPO.as_posix()}/") for name in here}
    gone = sorted(LEFT_OUT - here)
    assert len(gone) < 0.05 * len(LEFT_OUT), gone


def test_every_room_keeps_a_test():
    rooms = [room for room in (REPO / "tests").iterdir() if room.is_dir() and any(room.rglob("test_*.py"))]
    for room in rooms:
        if room.relative_to(REPO).as_posix() in NEVER:
            continue
        kept = [
            name
            for path in room.rglob("test_*.py")
            if path.relative_to(REPO).as_posix() not in LEFT_OUT
            for name in functions(path)
            if name not in LEFT_OUT
        ]
        assert kept, f"{room.name}: nothing is left in quick"


def test_the_parts_of_the_files_are_all_of_them_and_each_is_in_one():
    for path in (path.as_posix() for path in (REPO / "tests").rglob("test_*.py")):
        assert sum(is_in(path, f"{part}/3") for part in (1, 2, 3)) == 1


def test_functions_are_left_out_by_what_all_their_cases_take_and_whole_files_by_one_line():
    spent = {"a.py::x[1]": 0.08, "a.py::x[2]": 0.08, "a.py::y": 0.01, "b.py::z": 1.0}
    assert left_out(spent, 0.1) == ["a.py::x", "b.py"]
    old = ["a.py::not_run", "a.py::y", "b.py::not_run", "c.py"]
    assert left_out(spent, 0.1, old) == ["a.py::not_run", "a.py::x", "b.py", "c.py"]

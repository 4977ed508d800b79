"""What the short run leaves out exists, and each group of it says where the short run holds the same."""

import re
from pathlib import Path

from tests.brief import LIST, LONGEST, THOROUGH, is_thorough, place_in_run
from tests.test_quick import functions

REPO = Path(__file__).parents[1]


def test_all_that_is_left_to_the_thorough_run_exists():
    here = {name for path in (REPO / "tests").rglob("test_*.py") for name in functions(path)}
    assert {name.split("[")[0] for name in THOROUGH} <= here


def test_a_test_is_left_out_by_its_name_or_by_that_of_its_case():
    whole = next(name for name in THOROUGH if "[" not in name)
    case = next(name for name in THOROUGH if "[" in name)
    assert is_thorough(whole)
    assert is_thorough(f"{whole}[3]")
    assert is_thorough(case)
    assert not is_thorough(re.sub(r"\[.*", "[another]", case))


def test_each_group_names_its_files():
    """A comment above each group says where the short run holds the same."""
    for group in LIST.read_text().split("\n\n")[1:]:
        first, *names = group.strip().splitlines()
        assert first.startswith("# tests/")
        assert all(name.startswith("tests/") for name in names)


def test_files_that_take_long_come_last_and_the_longest_of_them_first():
    assert all((REPO / file).is_file() for file in LONGEST)
    assert [place_in_run(f"{file}::test_it[3]") for file in LONGEST[:3]] == [1, 2, 3]
    assert place_in_run("tests/test_brief.py::test_it") == 0

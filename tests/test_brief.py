"""What the short run leaves out exists, and each group of it says where the short run holds the same."""

import re
from pathlib import Path

from tests.brief import LIST, THOROUGH, is_thorough
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

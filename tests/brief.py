"""A plugin of pytest for `bash setup.sh test`: without what thorough.txt leaves to `bash setup.sh test thorough`.

Files that take long, as longest.txt has them, come last, the longest of them first: nobody waits for one at the end.
"""

from pathlib import Path

LIST = Path(__file__).with_name("thorough.txt")
THOROUGH = frozenset(line for line in LIST.read_text().splitlines() if line and not line.startswith("#"))
LONGEST = Path(__file__).with_name("longest.txt").read_text().splitlines()[1:]


def is_thorough(name: str) -> bool:
    """Whether a test is in the list, by its own name or by that of its function."""
    return name in THOROUGH or name.split("[")[0] in THOROUGH


def place_in_run(name: str) -> int:
    """Where a test belongs: 0 before all files that take long, then one place for each of those, the longest first."""
    return 1 + LONGEST.index(file) if (file := name.split("::")[0]) in LONGEST else 0


def pytest_collection_modifyitems(config, items):
    out = [item for item in items if is_thorough(item.nodeid)]
    config.hook.pytest_deselected(items=out)
    items[:] = [item for item in items if not is_thorough(item.nodeid)]
    items.sort(key=lambda item: place_in_run(item.nodeid))

"""A plugin of pytest for `bash setup.sh test`: without what thorough.txt leaves to `bash setup.sh test thorough`."""

from pathlib import Path

LIST = Path(__file__).with_name("thorough.txt")
THOROUGH = frozenset(line for line in LIST.read_text().splitlines() if line and not line.startswith("#"))


def is_thorough(name: str) -> bool:
    """Whether a test is in the list, by its own name or by that of its function."""
    return name in THOROUGH or name.split("[")[0] in THOROUGH


def pytest_collection_modifyitems(config, items):
    out = [item for item in items if is_thorough(item.nodeid)]
    config.hook.pytest_deselected(items=out)
    items[:] = [item for item in items if not is_thorough(item.nodeid)]

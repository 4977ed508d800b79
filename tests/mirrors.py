"""Where a module is tested: `tests/<room>/test_<module>.py`, but for the few that are listed here, with the reason.

`tests/test_layers.py` holds it for every module that computes; `benchmarks/mutation.py` runs these tests on mutants.
"""

from __future__ import annotations

from pathlib import Path, PurePath

TESTS = Path(__file__).parent

ROOMS_TESTED_AS_ONE = {
    "jobs": ("whole_workflow", "a job reads, calls its stage, writes: the whole workflow runs every one of them"),
    "settings": ("test_settings.py", "config.yaml is one thing, whatever the sections"),
    "commands": ("test_command.py", "each is run as a user runs it"),
    "preview": ("preview", "a preview is one thing: what the experiment will give"),
}
"""Rooms whose modules need no test file each: where they are tested, and the reason."""

OF_PICTURES = "video/test_recordings_of_pictures.py"
TESTED_UNDER_ANOTHER_NAME = {
    "video/decoded.py": "video/test_reader.py",
    "video/recording.py": "video/test_reader.py",
    "video/joined.py": OF_PICTURES,
    "video/stills/mraw.py": OF_PICTURES,
    "video/stills/numbered.py": OF_PICTURES,
    "video/times/own_stamps.py": OF_PICTURES,
    "video/stills/picture_stack.py": OF_PICTURES,
    "video/stills/tiff_pages.py": OF_PICTURES,
    "exchange/lens_files.py": "exchange/test_lens.py",
    "picking/desk.py": "picking/test_server.py",
}
"""Kinds of recordings are tested as the recordings that they are, the desk of the picking page by its requests."""


def mirror_of(module: PurePath) -> Path:
    """The test of a module, by its path inside of vidtrack; of a room tested as one: its own test, else the room's."""
    if other := TESTED_UNDER_ANOTHER_NAME.get(module.as_posix()):
        return TESTS / other
    own = TESTS / module.with_name(f"test_{module.name}")
    if not own.is_file() and module.parts[0] in ROOMS_TESTED_AS_ONE:
        return TESTS / ROOMS_TESTED_AS_ONE[module.parts[0]][0]
    return own

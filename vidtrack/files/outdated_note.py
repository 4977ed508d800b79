"""The note that lies beside results of an earlier call which do not belong to the present settings and inputs."""

from __future__ import annotations

import os
from collections.abc import Sequence

from vidtrack.files.atomic import replacing

NAME = "OUTDATED.txt"

TEXT = """These files are of an earlier call of vidtrack. They do not belong to the present settings and inputs:
what they are made of has changed since, or could not be made again. Do not use them. They are kept
because they count again where the earlier settings and inputs come back; else the next call that ends
well makes them anew. What the config no longer asks for is never made again: delete it.

"""


def write_note(folder: str, places: Sequence[str]) -> None:
    """Write the note into a folder. places: the results, by their places under results/."""
    with replacing(os.path.join(folder, NAME)) as file:
        file.write((TEXT + "\n".join(places) + "\n").encode())


def is_outdated(path: str) -> bool:
    """Whether a note in the folder of a result, or in one of the two above it, lists that result."""
    folder = os.path.dirname(path)
    for _ in range(3):
        note = os.path.join(folder, NAME)
        if os.path.isfile(note):
            with open(note, encoding="utf-8", errors="replace") as file:
                own = path.replace(os.sep, "/")
                return any(line and own.endswith(f"/{line}") for line in file.read().splitlines())
        folder = os.path.dirname(folder)
    return False

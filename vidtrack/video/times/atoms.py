"""The atoms of which MP4 and MOV files consist: a size, a kind of four letters, and contents."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

Span = tuple[int, int]
"""Where the contents of an atom begin and end in a file."""

MOST_ATOMS = 100_000
"""In one part of a file; a damaged file could hold any number of empty ones."""


def atoms(file: BinaryIO, span: Span | None = None) -> Iterator[tuple[bytes, Span]]:
    """Kind and place of the atoms one after the other in a part of a file; of the whole file where none is given.

    Ends at the first one whose size cannot be. One that claims more than the part has ends with it.
    """
    place, end = span or (0, file.seek(0, 2))
    for _ in range(MOST_ATOMS):
        if place + 8 > end:
            return
        file.seek(place)
        size, kind, head = int.from_bytes(file.read(4)), file.read(4), 8
        if size == 1:
            size, head = int.from_bytes(file.read(8)), 16
        size = size or end - place
        if size < head:
            return
        yield kind, (place + head, min(place + size, end))
        place += size

"""The index at the end of an AVI, read past damage.

Where bytes are missing or too many, libavformat does not find it, and makes one of the chunks that it comes upon: that
counts pictures as they follow each other, so that all behind the damage would come too early.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

HEADER = 8
"""Bytes before what a chunk holds: its name, and its size."""

TAIL = 32_000_000
"""Bytes from the end in which it is looked for: 16 for each chunk."""

_ENTRY = np.dtype([("name", "S4"), ("flags", "<u4"), ("at", "<u4"), ("size", "<u4")])

_NO_PICTURES = (b"wb", b"pc", b"tx")
"""How names of chunks of sound, palettes and text end."""


class Chunks(NamedTuple):
    """Where what the chunks of a stream hold lies in the file, bytes from its beginning, and how many bytes it is."""

    places: NDArray[np.int64]
    sizes: NDArray[np.int64]


def index_at_end(file: Any, first: int) -> Chunks | None:
    """The chunks of pictures of one stream; None where the file has no such index that fits it.

    file   open for reading, without damage near its end
    first  place of what its first chunk holds
    """
    length = file.seek(0, 2)
    begin = max(0, length - TAIL)
    file.seek(begin)
    tail = file.read(length - begin)
    at = tail.rfind(b"idx1")
    file.seek(max(0, first - HEADER))
    stream = file.read(2)
    if at < 0 or first < HEADER or not stream.isdigit():
        return None
    size = min(int.from_bytes(tail[at + 4 : at + HEADER], "little"), len(tail) - at - HEADER)
    entries = np.frombuffer(tail, _ENTRY, size // _ENTRY.itemsize, at + HEADER)
    own = entries[[name[:2] == stream and name[2:] not in _NO_PICTURES for name in entries["name"].tolist()]]
    if not len(own):
        return None
    places = own["at"].astype(np.int64) - int(own["at"][0]) + first
    return Chunks(places, own["size"].astype(np.int64))


def are_chunks(file: Any, begin: int, end: int) -> bool:
    """Whether what lies from `begin` to `end` in a file is whole chunks, or the beginnings of lists of such."""
    while begin < end:
        file.seek(begin)
        head = file.read(HEADER)
        if len(head) < HEADER:
            return False
        size = int.from_bytes(head[4:], "little")
        begin += HEADER + (4 if head[:4] in (b"LIST", b"RIFF") else size + size % 2)
    return begin == end

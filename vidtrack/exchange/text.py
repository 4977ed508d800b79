"""Text that other programs wrote: lines and numbers, from any decade and system.

Line ends of DOS, Unix and old Macs; the Ctrl-Z with which DOS ends a text; UTF-8 and UTF-16, else code page 437 or
Latin-1, which differ in letters that no number has. A comma between digits is a decimal mark where a file has no other.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Sequence

from vidtrack.errors import VidtrackError
from vidtrack.files.csv_text import read_bytes

Path = str | os.PathLike[str]

MISSING = frozenset(
    {"", "nan", "na", "n/a", "none", "null", "-", "--", "-nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind"}
)
"""How programs write a value that is not there, in small letters."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eEdD][+-]?\d+)?")


def bytes_of(path: Path) -> bytes:
    """A file's content; VidtrackError where it is not there, may not be read or is empty."""
    data = read_bytes(path)
    if not data or data.isspace():
        raise VidtrackError(f"{path}: an empty file. Copy it again.")
    return data


def text_of(path: Path, content: bytes | None = None) -> str:
    """A file's text with plain line ends; VidtrackError where it is no text.

    content   of the file, where it was read before
    """
    data = bytes_of(path) if content is None else content
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16", "replace")
    else:
        data = data.removeprefix(b"\xef\xbb\xbf")
        data = data.split(b"\x1a")[0] if b"\x1a" in data else data
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if "\0" in text:
        raise VidtrackError(f"{path}: not a text file. Put the text there that the program exported.")
    if not text or text.isspace():
        raise VidtrackError(f"{path}: an empty file. Copy it again.")
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def lines_of(path: Path) -> list[str]:
    """A file's lines, without line ends."""
    return text_of(path).split("\n")


def number(cell: str) -> float | None:
    """The value of a cell: NaN where it says that there is none, None where it is no number, or one beyond 1e308."""
    cell = cell.strip().strip('"').replace("\u2212", "-")
    if _COMMA.fullmatch(cell):
        cell = cell.replace(",", ".")
    if _NUMBER.fullmatch(cell):
        value = float(cell.replace("d", "e").replace("D", "e"))
        return value if math.isfinite(value) else None
    return float("nan") if cell.lower() in MISSING else None


def numbers(cells: Iterable[str]) -> list[float] | None:
    """The values of cells; None where one of them is no number."""
    found = [number(cell) for cell in cells]
    return None if any(value is None for value in found) else [float(value) for value in found if value is not None]


def leading_numbers(line: str) -> list[float]:
    """The numbers with which a line begins, up to the first word that is none."""
    found = []
    for word in line.split():
        value = number(word)
        if value is None or value != value:
            break
        found.append(value)
    return found


def short(text: str) -> str:
    """Text as a message shows it."""
    return repr(text if len(text) <= 40 else text[:37] + "...")


def some(names: Sequence[object], most: int = 6) -> str:
    """Names as a message lists them."""
    shown = ", ".join(str(name) for name in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"

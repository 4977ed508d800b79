"""C3D: points over time, of any maker and any of the three processors (Intel, DEC, MIPS), integers or floats.

Axes are those of the laboratory, right-handed (X_SCREEN and Y_SCREEN say how they lie on a screen and are not used);
the unit is POINT:UNITS. A point that was not seen has a negative fourth word (residual -1), or NaN; some programs
write zeros in all three coordinates besides. Frames from POINT:RATE, the first at 0 s; the format has no time of day
(VIDTRACK:START_TIME_S is vidtrack's own). More frames than 65,535 are counted by TRIAL:ACTUAL_START_FIELD and
ACTUAL_END_FIELD. Source: c3d.org, The C3D File Format User Guide.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.measured import Measured
from vidtrack.exchange.text import Path, bytes_of, number
from vidtrack.lengths import METRES

BLOCK = 512
INTEL, DEC, MIPS = 84, 85, 86
UNITS = {
    "mm": "mm",
    "millimeters": "mm",
    "millimetres": "mm",
    "cm": "cm",
    "m": "m",
    "meters": "m",
    "in": "in",
    "ft": "ft",
}


def read(path: Path) -> Measured:
    """All points of a C3D file."""
    data = bytes_of(path)
    try:
        return _read(path, data)
    except (struct.error, IndexError, ValueError, KeyError, UnicodeDecodeError) as error:
        raise VidtrackError(f"{path}: not a whole C3D file ({str(error)[:80]}). Copy it again.") from None


def _read(path: Path, data: bytes) -> Measured:
    if len(data) < 2 * BLOCK or data[1] != 0x50:
        raise VidtrackError(f"{path}: not a C3D file. Put one there, or a table as CSV.")
    at = (data[0] - 1) * BLOCK
    processor = data[at + 3]
    if processor not in (INTEL, DEC, MIPS):
        raise VidtrackError(f"{path}: a C3D file of an unknown processor ({processor}). Copy it again.")
    order = ">" if processor == MIPS else "<"
    own = _parameters(data, at, order, processor)
    n, per_frame = struct.unpack_from(order + "HH", data, 2)
    first, last = struct.unpack_from(order + "HH", data, 6)
    start = own.get(("POINT", "DATA_START"), [struct.unpack_from(order + "H", data, 16)[0]])[0]
    n = int(own.get(("POINT", "USED"), [n])[0]) & 0xFFFF
    scale, rate = float(own["POINT", "SCALE"][0]), float(own["POINT", "RATE"][0])
    if not rate > 0 or not n:
        raise VidtrackError(f"{path}: a C3D file without points, or without their rate. Export it with points.")
    width = 4 if scale < 0 else 2
    frame = width * (4 * n + per_frame)
    begins = (int(start) - 1) * BLOCK
    frames = _frames(own, first, last)
    if begins < BLOCK or begins + frames * frame > len(data):
        raise ValueError(f"{frames} frames of {frame} bytes from byte {begins} in a file of {len(data)}")
    words = np.frombuffer(data, np.uint8, frames * frame, begins).reshape(frames, frame)[:, : width * 4 * n]
    values = _numbers(np.ascontiguousarray(words), width, order, processor).reshape(frames, n, 4)
    p, fourth = values[..., :3] * (1.0 if scale < 0 else scale), values[..., 3]
    p = np.where((fourth < 0)[..., None] | ~np.isfinite(p), np.nan, p)
    unit = UNITS.get(str(own.get(("POINT", "UNITS"), [""])[0]).strip().lower())
    begun = number("".join(map(str, own.get(("VIDTRACK", "START_TIME_S"), []))))
    return Measured(
        "C3D",
        _labels(own, n),
        p,
        np.arange(frames) / rate,
        unit if unit in METRES else None,
        begun if begun is not None and begun == begun else None,
    )


def _frames(own: dict[tuple[str, str], list[Any]], first: int, last: int) -> int:
    begin, end = own.get(("TRIAL", "ACTUAL_START_FIELD")), own.get(("TRIAL", "ACTUAL_END_FIELD"))
    if begin and end and len(begin) == 2 and len(end) == 2:
        low, high = ((int(a) & 0xFFFF) + ((int(b) & 0xFFFF) << 16) for a, b in (begin, end))
        if high >= low:
            return high - low + 1
    return last - first + 1


def _labels(own: dict[tuple[str, str], list[Any]], n: int) -> tuple[str, ...]:
    """The names of n points, in LABELS, LABELS2 and on; those that have none are numbered, and none is there twice."""
    given: list[str] = []
    for more in ("", *range(2, 20)):
        given += [str(name).strip() for name in own.get(("POINT", f"LABELS{more}"), [])]
    names: list[str] = []
    for i in range(n):
        name = given[i] if i < len(given) and given[i] else f"p{i + 1}"
        while name in names:
            name += "'"
        names.append(name)
    return tuple(names)


def _parameters(data: bytes, at: int, order: str, processor: int) -> dict[tuple[str, str], list[Any]]:
    """Values by group and name; texts without the spaces behind them."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, list[Any]]] = []
    end = min(len(data), at + max(data[at + 2], 1) * BLOCK)
    place = at + 4
    while place + 4 <= end:
        length, group = struct.unpack_from("bb", data, place)
        length = abs(length)
        if not length:
            break
        name = data[place + 2 : place + 2 + length].decode("latin-1").upper()
        body = place + 2 + length
        offset = struct.unpack_from(order + "H", data, body)[0]
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _values(data, body + 2, order, processor)))
        if not offset:
            break
        place = body + offset
    return {(groups.get(group, ""), name): values for group, name, values in found if values}


def _values(data: bytes, at: int, order: str, processor: int) -> list[Any]:
    kind, dimensions = struct.unpack_from("bB", data, at)
    sizes = list(data[at + 2 : at + 2 + dimensions])
    begins, count = at + 2 + dimensions, int(np.prod(sizes, dtype=np.int64))
    if begins + abs(kind) * count > len(data):
        raise ValueError("a parameter that is longer than the file")
    if kind == -1:
        text = data[begins : begins + count]
        wide = sizes[0] if sizes else 1
        pieces = [text[i : i + wide] for i in range(0, count, wide)] if wide else []
        return [piece.decode("utf-8", "replace").rstrip(" \0") for piece in pieces]
    words = np.frombuffer(data, np.uint8, abs(kind) * count, begins)
    if kind == 1:
        return list(words.view(np.int8).tolist())
    return list(_numbers(words, kind, order, processor).ravel().tolist())


def _numbers(words: np.ndarray[Any, Any], width: int, order: str, processor: int) -> Array:
    """Integers of two bytes or floats of four, as a processor stores them."""
    if width == 2:
        return np.asarray(words.view(order + "i2"), float)
    if processor == DEC:  # the halves exchanged, and the exponent larger by two
        pairs = words.reshape(-1, 4)[:, [2, 3, 0, 1]]
        return np.asarray(np.ascontiguousarray(pairs).view("<f4"), float) / 4
    return np.asarray(words.view(order + "f4"), float)

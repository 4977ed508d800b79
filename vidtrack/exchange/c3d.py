"""C3D: points over time, the common format of motion capture.

Layout: https://www.c3d.org (The C3D File Format User Guide). Blocks of 512 bytes: a header, parameters, then for each
frame and point x, y, z and a word of state; written as little-endian floats (POINT:SCALE negative).

origin, axes    the world's, right-handed, as in points.csv; POINT:X_SCREEN and Y_SCREEN name the direction of the waves
                and the one that is up, where the config has the run's `axes`
units           mm (POINT:UNITS)
time            one rate (POINT:RATE) and frames from 1; seconds since midnight of the first frame stand as text in
                VIDTRACK:START_TIME_S. Samples that are not even in time are refused
missing         residual -1, and coordinates 0, as the guide has it: readers give NaN
residual        `miss`, how far the lines of sight miss the point, in whole multiples of |POINT:SCALE|. Readers
                differ in which byte of the word holds it (ezc3d: the high one; c3d: the low one), so it stands in
                both, and the camera mask, which would be the other, means nothing
limits          65,534 frames (a longer run is refused: readers stop there without a word), 255 bytes a name
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vidtrack.errors import VidtrackError
from vidtrack.exchange.measured import Run, Written, evenly, filled_gaps, series

BLOCK = 512
MOST_FRAMES = 65_534
"""One less than its 16 bits count: ezc3d 1.7 reads 65,535 frames as 65,536."""
MOST_BYTES = 255
"""Of a text or an axis of a parameter: its size is one byte."""
MOST_IN_PARAMETER = 32_000
"""Bytes of one parameter: the distance to the next one is a signed 16-bit word."""
LEVELS, BOTH_BYTES = 127, 257
"""Steps of the residual, of which the word's sign leaves seven bits; and what writes it into both bytes."""

Parameter = tuple[str, int, Sequence[int], bytes]
"""Name, type (-1 text, 2 integer of 16 bits, 4 float), axes, content."""


def write(run: Run) -> Written:
    """The trajectories of a run as one file.

    VidtrackError for samples that are not even in time, too many frames, or a name that is too long.
    """
    s = series(run.tables["trajectories"])
    even = evenly(s.time, run.name, "C3D")
    if even.length > MOST_FRAMES:
        raise VidtrackError(
            f"run {run.name}: {even.length} frames, and a C3D file holds {MOST_FRAMES}. Export netcdf, mat or parquet, "
            "or cut the run by detect.start and detect.end."
        )
    scale = run.in_unit("mm")
    p = even.filled(s.stacked("x", "y", "z")) * scale
    miss = even.filled(s.stacked("miss")[..., 0]) * scale
    seen: NDArray[np.bool_] = np.asarray(np.isfinite(p).all(-1))
    top = float(np.nanmax(np.where(seen, miss, np.nan), initial=0.0)) if seen.any() else 0.0
    step = top / LEVELS if top > 0 else 1.0
    word = np.where(seen, np.rint(np.nan_to_num(miss) / step).clip(0, LEVELS) * BOTH_BYTES, -1.0)
    data = np.concatenate([np.where(seen[..., None], p, 0.0), word[..., None]], -1).astype("<f4")
    parameters = _parameters(run, s.names, even.length, even.rate, even.start, step)
    blocks = -(-len(parameters) // BLOCK)
    widest_gap = int(np.diff(even.index).max()) - 1
    header = struct.pack(
        "<BBHHHHHfHHf", 2, 0x50, len(s.names), 0, 1, even.length, widest_gap, -step, 2 + blocks, 0, even.rate
    )
    content = header.ljust(BLOCK, b"\0") + parameters.ljust(blocks * BLOCK, b"\0") + data.tobytes()
    return Written({f"{run.name}.c3d": content + b"\0" * (-len(content) % BLOCK)}, filled_gaps(even, s.time))


def _parameters(run: Run, names: Sequence[str], frames: int, rate: float, start: float, step: float) -> bytes:
    blocks_guess = 1
    while True:  # DATA_START counts the blocks that hold it
        content = _section(run, names, frames, rate, start, step, 2 + blocks_guess)
        blocks = -(-(len(content) + 4) // BLOCK)
        if blocks == blocks_guess:
            return struct.pack("<BBBB", 1, 0x50, blocks, 84) + content
        if blocks > MOST_BYTES:
            raise VidtrackError(f"run {run.name}: {len(names)} targets' names do not fit in a C3D file. Shorten them.")
        blocks_guess = blocks


def _section(
    run: Run, names: Sequence[str], frames: int, rate: float, start: float, step: float, first_block: int
) -> bytes:
    point: list[Parameter] = [
        _integer("USED", len(names)),
        ("SCALE", 4, (), struct.pack("<f", -step)),
        ("RATE", 4, (), struct.pack("<f", rate)),
        _integer("DATA_START", first_block),
        _integer("FRAMES", frames),
        _texts("UNITS", ["mm"]),
        *_labels("LABELS", run, names),
        *_labels("DESCRIPTIONS", run, names),
    ]
    if run.up and run.waves:
        point += [_texts("X_SCREEN", [run.waves.upper()]), _texts("Y_SCREEN", [run.up.upper()])]
    analog = [_integer("USED", 0), ("SCALE", 4, (0,), b""), ("GEN_SCALE", 4, (), struct.pack("<f", 1.0))]
    analog += [
        ("RATE", 4, (), struct.pack("<f", 0.0)),
        ("OFFSET", 2, (0,), b""),
        _texts("UNITS", []),
        _texts("LABELS", []),
    ]
    own = [_texts("START_TIME_S", [f"{start:.6f}"]), _texts("RUN", [_short(run, run.name)])]
    makers = [_texts("SOFTWARE", ["vidtrack"]), _texts("VERSION", [run.version[:MOST_BYTES] or "unknown"])]
    content = b""
    for number, (group, parameters) in enumerate(
        (("POINT", point), ("ANALOG", analog), ("MANUFACTURER", makers), ("VIDTRACK", own)), 1
    ):
        content += struct.pack("<bb", len(group), -number) + group.encode() + struct.pack("<HB", 3, 0)
        for name, kind, axes, data in parameters:
            body = struct.pack("<bB", kind, len(axes)) + bytes(axes) + data + b"\0"
            content += struct.pack("<bb", len(name), number) + name.encode() + struct.pack("<H", len(body) + 2) + body
    return content + b"\0\0"


def _integer(name: str, value: int) -> Parameter:
    return name, 2, (), struct.pack("<H", value)


def _texts(name: str, texts: Sequence[str]) -> Parameter:
    encoded = [text.encode() for text in texts]
    width = max((len(text) for text in encoded), default=0)
    axes = (width, len(encoded)) if len(encoded) != 1 else (width,)
    return name, -1, axes, b"".join(text.ljust(width) for text in encoded)


def _labels(name: str, run: Run, labels: Sequence[str]) -> list[Parameter]:
    """Names in as many parameters (LABELS, LABELS2, ...) as their sizes ask for."""
    width = max((len(_short(run, label).encode()) for label in labels), default=1)
    each = max(1, min(MOST_BYTES, MOST_IN_PARAMETER // max(width, 1)))
    parts = [labels[i : i + each] for i in range(0, len(labels), each)] or [[]]
    return [_texts(name + (str(i) if i > 1 else ""), [f"{label}" for label in part]) for i, part in enumerate(parts, 1)]


def _short(run: Run, name: str) -> str:
    if len(name.encode()) > MOST_BYTES:
        raise VidtrackError(
            f"run {run.name}: the name {name[:30]!r}... has {len(name.encode())} bytes; C3D holds {MOST_BYTES}. "
            "Shorten it."
        )
    return name

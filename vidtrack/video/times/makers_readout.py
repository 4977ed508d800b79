"""What a camera's maker writes into the file of how long the sensor takes to read a picture: GoPro's `SROT`.

GoPro keeps numbers as keys of four letters, a type, a size and a count (GPMF, published by the maker). `SROT`, the
sensor's read-out time in ms, is in the header of the film (`moov/udta/GPMF`, from HERO8 on), or with each payload of
the track of type `gpmd` (HERO6, HERO7). Other makers publish no such number: see docs/rolling-shutter.md.
"""

from __future__ import annotations

import os
import struct
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from vidtrack.video.times.atoms import Span, atoms


class Limits(NamedTuple):
    """What is taken for a read-out, and how much of a file is looked at."""

    shortest_ms: float = 1.0
    longest_ms: float = 50.0
    of_interval: float = 1.02
    """Of the time from one picture to the next: no sensor reads two pictures at once."""
    most_bytes: int = 1 << 20
    """Of a header or a payload; real ones have some kB."""
    deepest: int = 8


LIMITS = Limits()
_NUMBERS = {"b": "i1", "B": "u1", "s": ">i2", "S": ">u2", "l": ">i4", "L": ">u4", "f": ">f4", "d": ">f8"}


class MakersReadout(NamedTuple):
    """What a file says of its read-out.

    ms       of all rows, as stated
    source   who says it
    doubt    why it is not to be used; "" where it is
    steady   False where the camera's electronic stabiliser was on, which moves the picture; None: not known
    """

    ms: float
    source: str
    doubt: str = ""
    steady: bool | None = None

    def as_record(self) -> dict[str, Any]:
        return self._asdict()


def makers_readout(path: str, interval_s: float, rotation: int = 0) -> MakersReadout | None:
    """What the file of a recording says of its read-out; None where it says nothing, or is no MP4 or MOV.

    interval_s  from one picture to the next; rotation: degrees by which the file says that its picture is turned
    Damaged or hostile contents are passed over.
    """
    try:
        with open(path, "rb") as file:
            if file.read(8)[4:] not in (b"ftyp", b"mdat", b"moov", b"wide", b"free"):
                return None
            found = _found(file, os.fstat(file.fileno()).st_size)
    except (OSError, OverflowError, ValueError):
        return None
    if "SROT" not in found:
        return None
    values = _numbers(found["SROT"])
    ms = float(np.median(values)) if len(values) else float("nan")
    model = _text(found.get("MINF"))
    source = f"GoPro's SROT{f', {model}' if model else ''}"
    stabilised = _text(found.get("EISE"))[:1]
    doubt = _doubt(ms, interval_s, _text(found.get("OREN"))[:1], rotation)
    return MakersReadout(ms, source, doubt, {"Y": False, "N": True}.get(stabilised))


def _doubt(ms: float, interval_s: float, up: str, rotation: int) -> str:
    if not LIMITS.shortest_ms <= ms <= LIMITS.longest_ms:
        return f"no camera reads a picture in {ms:g} ms"
    if ms > LIMITS.of_interval * 1e3 * interval_s:
        return f"{ms:g} ms are more than the {1e3 * interval_s:.4g} ms from one picture to the next"
    if up not in ("", "U") and not rotation:
        return "the camera stood on its side or head and turned the picture itself, so that its first row is not known"
    return ""


class Entry(NamedTuple):
    """A key's numbers or letters, as stored."""

    kind: str
    data: bytes


def _found(file: BinaryIO, size: int) -> dict[str, Entry]:
    """The first entry of each key in the film's header, else in the first payload of its track of type gpmd."""
    for kind, span in atoms(file, (0, size)):
        if kind != b"moov":
            continue
        for part, inside in atoms(file, span):
            if part == b"udta":
                for own, at in atoms(file, inside):
                    if own == b"GPMF" and "SROT" in (found := _entries(_bytes(file, at))):
                        return found
        for part, inside in atoms(file, span):
            if part == b"trak" and (payload := _first_payload(file, inside)):
                found = _entries(_bytes(file, payload))
                if "SROT" in found:
                    return found
    return {}


def _first_payload(file: BinaryIO, trak: Span) -> Span | None:
    """Where the first sample of a track of type gpmd lies (ISO 14496-12: stsd, stsz, stco, co64)."""
    tables: dict[bytes, bytes] = {}
    spans = [trak]
    for name in (b"mdia", b"minf", b"stbl"):
        spans = [at for span in spans for kind, at in atoms(file, span) if kind == name]
    for span in spans:
        for kind, at in atoms(file, span):
            if kind in (b"stsd", b"stsz", b"stco", b"co64"):
                tables[kind] = _bytes(file, (at[0], min(at[1], at[0] + 24)))
    if tables.get(b"stsd", b"")[12:16] != b"gpmd":
        return None
    sizes, near, far = (tables.get(kind, b"") for kind in (b"stsz", b"stco", b"co64"))
    length = int.from_bytes(sizes[4:8]) or int.from_bytes(sizes[12:16])
    start = int.from_bytes(near[8:12]) if near else int.from_bytes(far[8:16])
    return (start, start + length) if start and length else None


def _bytes(file: BinaryIO, span: Span) -> bytes:
    file.seek(span[0])
    return file.read(max(0, min(span[1] - span[0], LIMITS.most_bytes)))


def _entries(data: bytes, depth: int = 0) -> dict[str, Entry]:
    """The first entry of each key, those of nested ones too; what runs beyond the data ends it."""
    found: dict[str, Entry] = {}
    place = 0
    while place + 8 <= len(data):
        key, kind, size, repeat = struct.unpack_from(">4scBH", data, place)
        length = size * repeat
        own = data[place + 8 : place + 8 + length]
        if len(own) < length or not key.strip(b"\0"):
            break
        if kind != b"\0":
            found.setdefault(key.decode("latin-1"), Entry(kind.decode("latin-1"), own))
        elif depth < LIMITS.deepest:
            for name, entry in _entries(own, depth + 1).items():
                found.setdefault(name, entry)
        place += 8 + length + -length % 4
    return found


def _numbers(entry: Entry) -> np.ndarray[Any, Any]:
    kind = _NUMBERS.get(entry.kind)
    whole = len(entry.data) - len(entry.data) % np.dtype(kind).itemsize if kind else 0
    values = np.frombuffer(entry.data[:whole], kind or "u1").astype(float)
    return np.asarray(values[np.isfinite(values)])


def _text(entry: Entry | None) -> str:
    if entry is None or entry.kind != "c":
        return ""
    said = entry.data.split(b"\0")[0].decode("latin-1")
    return "".join(letter for letter in said if letter.isprintable()).strip()[:40]

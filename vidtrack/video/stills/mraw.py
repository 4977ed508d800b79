"""Photron's .mraw: pictures without a header, described by a .cih or .cihx file of the same name beside it."""

from __future__ import annotations

import os
import re
from fractions import Fraction

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Luma
from vidtrack.video.container import refuse_giants
from vidtrack.video.stills.picture_stack import StackInfo

_HEADER_BYTES = 1 << 20


class MrawPictures:
    """The pictures of an .mraw file; grey, of 8, 10 (packed), 12 (packed or in 16) or 16 bits."""

    def __init__(self, path: str) -> None:
        self.path = path
        header = _header(path)
        words = {key: next((header[n] for n in names if n in header), None) for key, names in _KEYS.items()}
        width, height = (_number(path, words, key) for key in ("width", "height"))
        stored, rate = _number(path, words, "stored"), _number(path, words, "rate")
        if "color" in str(header.get("color type") or header.get("type") or "").lower():
            raise VidtrackError(f"{path}: colour .mraw files are not read. Save the recording as AVI or TIFF.")
        if not width * height:
            raise VidtrackError(f"{path}: its header gives pictures of {width} x {height}. Copy the .cih again.")
        refuse_giants(path, width, height)
        if stored not in (8, 10, 12, 16) or not (width * height * stored) % 8 == 0:
            raise VidtrackError(f"{path}: {stored} bits per pixel are not read. Save the recording with 8, 12 or 16.")
        self._shape, self._stored = (height, width), stored
        self._bytes = width * height * stored // 8
        there = os.path.getsize(path) // self._bytes
        claimed = _number(path, words, "total") if words["total"] else there
        self.notes = [f"the .cih states {claimed} pictures, the .mraw holds {there}"] if there < claimed else []
        self.numbers = list(range(min(there, claimed)))
        if not self.numbers:
            raise VidtrackError(f"{path}: holds no whole picture. Copy the recording again.")
        effective = _number(path, words, "effective") if words["effective"] else stored
        if not 0 < effective <= stored:
            raise VidtrackError(f"{path}: its header gives {effective} of {stored} bits. Copy the .cih again.")
        side = str(words["side"] or "lower").lower()
        self._shift = stored - effective if stored == 16 and side.startswith("higher") else 0
        bits = max(8, min(16, effective))
        self.info = StackInfo(
            width, height, bits, "mraw", "gray" if bits == 8 else f"gray{bits}le", Fraction(rate) if rate else None
        )

    def picture(self, place: int) -> tuple[Luma, bool]:
        """As `Stack.picture`."""
        with open(self.path, "rb") as file:
            file.seek(place * self._bytes)
            data = np.frombuffer(file.read(self._bytes), np.uint8)
        if len(data) < self._bytes:
            raise VidtrackError(f"{self.path}: picture {place} is cut off. Copy the recording again.")
        return _unpacked(data, self._stored, self._shift).reshape(self._shape), False


_KEYS = {
    "width": ("image width", "width"),
    "height": ("image height", "height"),
    "stored": ("color bit", "bit"),
    "effective": ("effectivebit depth", "depth"),
    "side": ("effectivebit side", "side"),
    "rate": ("record rate(fps)", "recordrate"),
    "total": ("total frame", "totalframe"),
}


def _unpacked(data: np.ndarray, bits: int, shift: int) -> Luma:
    """Levels of packed samples: at 10 and 12 bits one after the other, the first bit of each the highest."""
    if bits == 8:
        return data
    if bits == 16:
        return data.view("<u2") >> shift if shift else data.view("<u2").copy()
    each = data.reshape(-1, 3 if bits == 12 else 5).astype(np.uint16)
    if bits == 12:
        pairs = (each[:, 0] << 4 | each[:, 1] >> 4, (each[:, 1] & 15) << 8 | each[:, 2])
        return np.stack(pairs, axis=-1).ravel()
    parts = [(each[:, k] << 2 * (k + 1) | each[:, k + 1] >> (6 - 2 * k)) & 1023 for k in range(4)]
    return np.stack(parts, axis=-1).ravel()


def _header(path: str) -> dict[str, str]:
    """Keys, in small letters, and values of the header; VidtrackError where there is none."""
    stem = os.path.splitext(path)[0]
    for ending in (".cih", ".cihx", ".CIH", ".CIHX"):
        if os.path.isfile(stem + ending):
            with open(stem + ending, "rb") as file:
                text = file.read(_HEADER_BYTES).decode("utf-8", "replace")
            break
    else:
        raise VidtrackError(f"{path}: its header {os.path.basename(stem)}.cih is not beside it. Put it there.")
    # no parser of XML: no entities, no other files
    tagged = {
        key: value for key, value, end in re.findall(r"<([A-Za-z]{1,40})>([^<>]*)</([^<>]{1,40})>", text) if key == end
    }
    lines = (line.partition(":") for line in text.splitlines())
    plain = {key: value for key, colon, value in lines if colon and not re.search("[<>]", key)}
    return {key.strip().lower(): value.strip() for key, value in (tagged or plain).items()}


def _number(path: str, header: dict[str, str | None], key: str) -> int:
    value = header[key]
    if value is None or not re.fullmatch(r"\d{1,9}(\.\d*)?", value):
        raise VidtrackError(f"{path}: its header gives no {_KEYS[key][0]} ({value!r}). Copy the .cih again.")
    return int(float(value))

"""JSON records and pictures in and out; a record always says where it comes from."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError, damaged
from vidtrack.files.atomic import replacing

CHECKSUM = "checksum"
"""The last key of a record."""

DIGITS, END = b"0" * 64, b'"\n}\n'
"""Its digits before they are known, and what stands after them."""

GREY_LEVEL = 256
"""Levels of a 16-bit picture that stand for one grey level of 0 to 255."""


def write_json(path: str | os.PathLike[str], record: Mapping[str, Any], provenance: Mapping[str, Any]) -> None:
    """Write a record, its provenance under the key of that name; NaN and infinities become null.

    The same record makes the same bytes, whatever the day. Its last key is `checksum`, see `write_record`.
    """
    write_record(path, {**record, "provenance": provenance})


def write_record(path: str | os.PathLike[str], record: Mapping[str, Any]) -> None:
    """Write a record, and as its last key `checksum`: the SHA-256 of all text before it.

    Without it a digit that becomes another digit, by a flipped bit, would be read as another number.
    """
    text = _text(record)
    with replacing(path) as file:
        file.write(text[: -len(DIGITS + END)] + _checksum(text).encode() + END)


def read_json(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The record at `path`, without its checksum.

    Raises VidtrackError where it is not JSON, or was changed since it was written. A record without a checksum (of an
    older version, or made by hand) is read as it is; spaces and ends of lines may be others than those written.
    """
    with open(path, "rb") as file:
        data = file.read()
    try:
        record = json.loads(data.decode())
    except json.JSONDecodeError as error:
        raise VidtrackError(
            f"{path}, line {error.lineno}: not valid JSON ({error.msg}). Delete the file and run again."
        ) from None
    except (ValueError, RecursionError) as error:  # bytes that are no text, a number of 5000 digits
        raise damaged(path, "not valid JSON", error) from None
    if not isinstance(record, dict):
        raise VidtrackError(f"{path}: holds no record. Delete the file and run again.")
    if CHECKSUM in record and not _agrees(record.pop(CHECKSUM), data, record):
        raise VidtrackError(
            f"{path}: was changed since it was written: its checksum does not agree. Delete the file and run again; "
            f'if you changed it yourself and mean it, delete its last entry, "{CHECKSUM}", instead.'
        )
    return record


def _text(record: Mapping[str, Any]) -> bytes:
    """The file of a record, with zeros for its checksum."""
    own = {key: value for key, value in record.items() if key != CHECKSUM} | {CHECKSUM: DIGITS.decode()}
    return (json.dumps(plain(own), indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _agrees(stated: object, data: bytes, record: dict[str, Any]) -> bool:
    """Whether a checksum is that of the file's text, or else of the text as vidtrack writes it."""
    try:
        return stated == _checksum(data) or stated == _checksum(_text(record))
    except (ValueError, RecursionError):  # what vidtrack would not write
        return False


def _checksum(text: bytes) -> str:
    """The checksum of a file's text, which ends with one, whatever its digits are."""
    return hashlib.sha256(text[: -len(DIGITS + END)]).hexdigest()


def write_png(path: str | os.PathLike[str], picture: np.ndarray[Any, Any]) -> None:
    """Write a picture (h, w) grey or (h, w, 3) RGB, 8 or 16 bit, as PNG."""
    import cv2

    if picture.ndim == 3:
        picture = picture[..., ::-1]
    try:
        good, data = cv2.imencode(".png", np.ascontiguousarray(picture))
    except cv2.error:
        good = False
    if not good:
        raise ValueError(f"a picture of shape {picture.shape} and type {picture.dtype} cannot be a PNG")
    with replacing(path) as file:
        file.write(data.tobytes())


def read_png(path: str | os.PathLike[str]) -> np.ndarray[Any, Any]:
    """The picture at `path` as it is stored: (h, w) or (h, w, 3) RGB."""
    import cv2

    data = np.fromfile(path, np.uint8)
    try:
        picture: np.ndarray[Any, Any] | None = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    except cv2.error:
        picture = None
    if picture is None:
        raise VidtrackError(f"{path}: not a picture. Delete the file and run again.")
    return picture[..., ::-1] if picture.ndim == 3 else picture


def plain(value: Any) -> Any:
    # whether something is a Mapping takes longest to see, and few values are
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    return str(value)

"""A TIFF of several pages as a recording: libavcodec reads the first page alone.

Source: TIFF 6.0, sections 2 and 7; BigTIFF; ImageJ's stacks of more than 4 GB, whose pages have one directory.
"""

from __future__ import annotations

import re
import struct
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Luma
from vidtrack.timing.timecode import exact_rate
from vidtrack.video.container import refuse_giants
from vidtrack.video.stills.picture_stack import StackInfo

MOST_PAGES = 10_000_000
AT_ONCE = 16
"""Pages that are read in one go: libtiff walks through all directories before them each time."""

AT_ONCE_BYTES = 64_000_000
_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _DESCRIPTION, _STRIPS, _SAMPLES, _NEW = 256, 257, 258, 259, 270, 273, 277, 254
_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}


class Page(NamedTuple):
    """What is read of a page's directory: values of tags, the first one of each."""

    tags: dict[int, int]
    description: bytes


def page_count(path: str) -> int:
    """Pages of a TIFF that are pictures of their own (no thumbnails), as ImageJ counts them too; 0 for another file."""
    pages, _ = _pages(path)
    if len(pages) == 1:
        return max(1, _images_of_imagej(pages[0]))
    return len(pages)


class TiffPages:
    """The pages of a TIFF, in their order."""

    def __init__(self, path: str, colour: Any = None) -> None:
        self.path, self._colour = path, colour
        pages, self._order = _pages(path)
        first = pages[0]
        width, height = first.tags.get(_WIDTH, 0), first.tags.get(_HEIGHT, 0)
        for page in pages:
            refuse_giants(path, page.tags.get(_WIDTH, 0), page.tags.get(_HEIGHT, 0))
        bits = first.tags.get(_BITS, 8)
        if bits not in (8, 16):
            raise VidtrackError(f"{path}: {bits} bits a sample in a TIFF of several pages. Save it with 8 or 16.")
        if colour is not None and first.tags.get(_SAMPLES, 1) < 3:
            raise VidtrackError(f"{path}: detect.colour is set, and the pages are grey. Remove it for this camera.")
        self.notes: list[str] = []
        self._shape, self._bits = (height, width), bits
        self._places = [place for place, page in enumerate(pages) if not page.tags.get(_NEW, 0) & 1]
        self._raw: np.ndarray | None = None
        if len(pages) == 1:
            self._raw = self._stored_in_one_piece(first)
            self._places = list(range(len(self._raw)))
        self.numbers = list(range(len(self._places)))
        self._held: dict[int, Luma] = {}
        rate = _rate_of_imagej(first)
        self.info = StackInfo(width, height, bits, "tiff", "gray" if bits == 8 else "gray16le", rate)

    def picture(self, place: int) -> tuple[Luma, bool]:
        """As `Stack.picture`."""
        if self._raw is not None:
            return self._raw[place].astype(self._raw.dtype.newbyteorder("=")), False
        if place not in self._held:
            size = self._shape[0] * self._shape[1] * self._bits // 8
            self._read(place, max(1, min(AT_ONCE, AT_ONCE_BYTES // max(1, size))))
        return self._held.pop(place), False

    def _read(self, place: int, many: int) -> None:
        import cv2  # libtiff, for files of several pages alone

        begin = self._places[place]
        many = min(many, self._places[-1] + 1 - begin)
        try:
            good, pictures = cv2.imreadmulti(self.path, start=begin, count=many, flags=cv2.IMREAD_UNCHANGED)
        except cv2.error:
            good, pictures = False, ()
        if not good or not pictures:
            raise VidtrackError(f"{self.path}: page {begin + 1} cannot be read. Save the file again.")
        places = {page: k for k, page in enumerate(self._places)}
        self._held = {
            places[begin + k]: self._levels(picture) for k, picture in enumerate(pictures) if begin + k in places
        }

    def _levels(self, picture: Any) -> Luma:
        if self._colour is None:
            return _grey(picture)
        from vidtrack.video.colour import colour_of_bgr

        return colour_of_bgr(picture, self._colour)

    def _stored_in_one_piece(self, page: Page) -> np.ndarray:
        count, tags = _images_of_imagej(page), page.tags
        if tags.get(_COMPRESSION, 1) != 1 or tags.get(_SAMPLES, 1) != 1:
            raise VidtrackError(f"{self.path}: an ImageJ stack with colours or compressed. Save it as single pages.")
        dtype = np.dtype(np.uint8 if self._bits == 8 else f"{self._order}u2")
        try:
            return np.memmap(self.path, dtype, "r", tags.get(_STRIPS, 0), (count, *self._shape))
        except (ValueError, OSError):
            raise VidtrackError(
                f"{self.path}: states {count} pages and is too short for them. Copy it again."
            ) from None


def _grey(picture: Any) -> Luma:
    if picture.ndim == 2:
        return np.asarray(picture)
    import cv2

    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGRA2GRAY if picture.shape[2] == 4 else cv2.COLOR_BGR2GRAY))


def _images_of_imagej(page: Page) -> int:
    found = re.search(rb"^images=(\d{1,9})", page.description, re.MULTILINE)
    return int(found[1]) if found and page.description.startswith(b"ImageJ") else 1


def _rate_of_imagej(page: Page) -> Any:
    found = re.search(rb"^fps=([\d.]{1,12})", page.description, re.MULTILINE)
    if not found or not page.description.startswith(b"ImageJ"):
        return None
    try:
        rate = float(found[1])
    except ValueError:
        return None
    return exact_rate(rate) if rate > 0 else None


def _pages(path: str) -> tuple[list[Page], str]:
    """The directories of a TIFF and its byte order ("<" or ">"); none where the file is no TIFF."""
    with open(path, "rb") as file:
        head = file.read(16)
        order = {b"II": "<", b"MM": ">"}.get(head[:2])
        if order is None or len(head) < 8:
            return [], "<"
        (version,) = struct.unpack_from(order + "H", head, 2)
        if version not in (42, 43) or (version == 43 and len(head) < 16):
            return [], order
        pages: list[Page] = []
        seen: set[int] = set()
        (at,) = struct.unpack_from(order + ("I" if version == 42 else "Q"), head, 4 if version == 42 else 8)
        while at and at not in seen and len(pages) < MOST_PAGES:
            seen.add(at)
            try:
                page, at = _directory(file, at, order, big=version == 43)
            except (struct.error, OSError, OverflowError):
                break
            pages.append(page)
        return pages, order


def _directory(file: BinaryIO, at: int, order: str, *, big: bool) -> tuple[Page, int]:
    file.seek(at)
    (count,) = struct.unpack(order + ("Q" if big else "H"), file.read(8 if big else 2))
    entry, word = (20, "Q") if big else (12, "I")
    if count > 4096:
        raise struct.error("no directory")
    block = file.read(entry * count + (8 if big else 4))
    (following,) = struct.unpack_from(order + word, block, entry * count)
    tags, text = {}, b""
    for k in range(count):
        tag, kind = struct.unpack_from(order + "HH", block, entry * k)
        (many,) = struct.unpack_from(order + word, block, entry * k + 4)
        place = entry * k + (12 if big else 8)
        within = _SIZES.get(kind, 1) * many <= (8 if big else 4)
        if tag == _DESCRIPTION and kind == 2 and not within:
            (where,) = struct.unpack_from(order + word, block, place)
            file.seek(where)
            text = file.read(min(many, 4096))
        elif kind in (3, 4, 16) and many:
            if not within:
                (where,) = struct.unpack_from(order + word, block, place)
                file.seek(where)
                block_of_it, place_of_it = file.read(8), 0
            else:
                block_of_it, place_of_it = block, place
            tags[tag] = struct.unpack_from(order + {3: "H", 4: "I", 16: "Q"}[kind], block_of_it, place_of_it)[0]
    return Page(tags, text), following

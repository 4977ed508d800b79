"""A still that is stored in tiles (HEIC, AVIF), put together: each tile is a picture of its own there.

Source: ISO/IEC 23008-12, sections 6.5 (properties), 6.6.2.3 (image grid), 9.3; ISO/IEC 14496-12, section 8.11 (the meta
box, item locations); AV1 Image File Format 1.1.0, section 4.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

import av
import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Luma
from vidtrack.video.container import refuse_giants
from vidtrack.video.luma import bits_of, colour_bits_of, luma_reader
from vidtrack.video.orientation import STORED, Orientation
from vidtrack.video.stills.picture_stack import StackInfo

ENDINGS = (".heic", ".heif", ".hif", ".avif")
LARGEST_META = 16_000_000
"""Bytes of the box that describes all items."""

MOST_TILES = 4096


class _Kind(NamedTuple):
    """The codec of tiles, its decoder, and the property that sets it up."""

    codec: str
    decoder: str
    setup: str


_CODECS = {"hvc1": _Kind("hevc", "hevc", "hvcC"), "av01": _Kind("av1", "libdav1d", "av1C")}


class Grid(NamedTuple):
    """rows, columns of tiles; width, height: px of the whole, which the tiles cover; turn: how it is shown."""

    rows: int
    columns: int
    width: int
    height: int
    kind: str
    setup: bytes
    tiles: list[bytes]
    turn: Orientation


def is_tiled(path: str) -> bool:
    """Whether a file is a still whose picture is a grid of tiles."""
    if not path.lower().endswith(ENDINGS) or not os.path.isfile(path):
        return False
    try:
        items = _Items(path)
        return items.kinds.get(items.primary) == "grid"
    except (struct.error, ValueError, KeyError, IndexError, OSError):
        return False


class HeicTiles:
    """The one picture of a still in tiles, as a stack of one."""

    def __init__(self, path: str, colour: Any = None) -> None:
        self.path, self._colour = path, colour
        self.numbers, self.notes = [0], list[str]()
        try:
            self._grid = _grid(_Items(path))
        except (struct.error, ValueError, KeyError, IndexError):
            raise VidtrackError(f"{path}: its tiles cannot be made out. Save it as PNG or JPEG.") from None
        refuse_giants(path, self._grid.width, self._grid.height)
        first = self._decoded(self._grid.tiles[0])
        turn = self._grid.turn
        size = (self._grid.width, self._grid.height)
        width, height = size[::-1] if turn.transposed else size
        bits = bits_of(first.format) if colour is None else colour_bits_of(first)
        codec = _CODECS[self._grid.kind].codec
        self.info = StackInfo(
            width, height, bits, codec, first.format.name, None, turn.rotation, turn.mirrored, still=True
        )
        self._whole = self._put_together()  # what is wrong with it shows now

    def picture(self, place: int) -> tuple[Luma, bool]:
        """As `Stack.picture`."""
        return self._whole

    def _put_together(self) -> tuple[Luma, bool]:
        grid, corrupt, whole = self._grid, False, None
        for k, data in enumerate(grid.tiles):
            picture = self._decoded(data)
            corrupt |= bool(picture.is_corrupt)
            levels = self._levels(picture)
            height, width = levels.shape
            if whole is None:
                if width * grid.columns < grid.width or height * grid.rows < grid.height:
                    raise VidtrackError(f"{self.path}: its tiles do not cover it. Save it as PNG or JPEG.")
                whole = np.zeros((height * grid.rows, width * grid.columns), levels.dtype)
                size = levels.shape
            if levels.shape != size:
                raise VidtrackError(f"{self.path}: tiles of several sizes. Save it as PNG or JPEG.")
            row, column = divmod(k, grid.columns)
            whole[row * height : (row + 1) * height, column * width : (column + 1) * width] = levels
        assert whole is not None
        cropped = whole[: grid.height, : grid.width]
        return np.array(grid.turn.applied(lambda own: own)(np.ascontiguousarray(cropped))), corrupt

    def _levels(self, picture: Any) -> Luma:
        if self._colour is None:
            return luma_reader(picture.format)(picture)
        from vidtrack.video.colour import colour_reader  # cv2, for colour alone

        return colour_reader(picture, _CODECS[self._grid.kind].codec, self._colour, self.path)(picture)

    def _decoded(self, data: bytes) -> Any:
        try:
            codec = av.CodecContext.create(_CODECS[self._grid.kind].decoder, "r")
            codec.extradata = self._grid.setup
            pictures = [*codec.decode(av.Packet(data)), *codec.decode(None)]
        except (av.error.FFmpegError, ValueError):
            pictures = []
        if not pictures:
            raise VidtrackError(f"{self.path}: a tile cannot be decoded. Copy it again, or save it as PNG or JPEG.")
        return pictures[0]


def _grid(items: _Items) -> Grid:
    """What the primary item is made of; ValueError, KeyError, IndexError or struct.error for one that is damaged."""
    tiles = items.parts[items.primary]
    version, flags, rows, columns = struct.unpack_from(">BBBB", data := items.content(items.primary))
    width, height = struct.unpack_from(">II" if flags & 1 else ">HH", data, 4)
    rows, columns = rows + 1, columns + 1
    kinds = {items.kinds[tile] for tile in tiles}
    kind = kinds.pop()
    setups = {dict(items.properties(tile))[_CODECS[kind].setup] for tile in tiles}
    if version or kinds or len(setups) != 1 or len(tiles) != rows * columns or len(tiles) > MOST_TILES:
        raise ValueError("not a grid of equal tiles")
    turn = STORED
    for name, value in items.properties(items.primary):
        if name in ("irot", "imir"):
            turn = _then(turn, name, value[0])
    return Grid(rows, columns, width, height, kind, setups.pop(), [items.content(tile) for tile in tiles], turn)


def _then(turn: Orientation, name: str, value: int) -> Orientation:
    """An orientation, and a turn (irot: quarters anticlockwise) or a mirror (imir: about the vertical axis 0, or 1)."""
    for _ in range(value & 3 if name == "irot" else 0):
        transposed, flip_x, flip_y = turn  # a quarter anticlockwise exchanges rows and columns, then reverses rows
        turn = Orientation(not transposed, flip_y, not flip_x)
    if name == "imir":
        turn = turn._replace(flip_x=not turn.flip_x) if value & 1 else turn._replace(flip_y=not turn.flip_y)
    return turn


class _Items:
    """The items of a file: what kind each is, of which others it is made, its properties, its bytes."""

    def __init__(self, path: str) -> None:
        self._path = path
        with open(path, "rb") as file:
            meta = _meta(file)
        boxes = dict(_boxes(meta, 4))
        (self.primary,) = struct.unpack_from(">I" if boxes["pitm"][0] else ">H", boxes["pitm"], 4)
        self.kinds = dict(_kinds(boxes["iinf"]))
        self.parts = dict(_references(boxes.get("iref", bytes(4))))
        self._places = dict(_locations(boxes["iloc"]))
        self._idat = boxes.get("idat", b"")
        inside = dict(_boxes(boxes["iprp"]))
        self._all = list(_boxes(inside["ipco"]))
        self._own = dict(_associations(inside["ipma"]))

    def properties(self, item: int) -> list[tuple[str, bytes]]:
        """Name and content of each property of an item, in order."""
        return [self._all[k - 1] for k in self._own[item] if k]

    def content(self, item: int) -> bytes:
        """The bytes of an item."""
        within, extents = self._places[item]
        if within:
            return b"".join(self._idat[at : at + length] for at, length in extents)
        size = os.stat(self._path).st_size
        with open(self._path, "rb") as file:
            parts = []
            for at, length in extents:
                if at + length > size:
                    raise ValueError("beyond the end of the file")
                file.seek(at)
                parts.append(file.read(length or size - at))
        return b"".join(parts)


def _meta(file: Any) -> bytes:
    """The content of the meta box; ValueError where there is none."""
    while head := file.read(8):
        size, name = struct.unpack(">I4s", head)
        room = size - 8
        if size == 1:
            room = struct.unpack(">Q", file.read(8))[0] - 16
        if name == b"meta" and 0 < room <= LARGEST_META:
            return bytes(file.read(room))
        if room < 0:
            break
        file.seek(room, 1)
    raise ValueError("no meta box")


def _boxes(data: bytes, at: int = 0) -> Iterator[tuple[str, bytes]]:
    while at + 8 <= len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        head = 8
        if size == 1:
            (size,), head = struct.unpack_from(">Q", data, at + 8), 16
        size = size or len(data) - at
        if size < head or at + size > len(data):
            raise ValueError("a box beyond its end")
        yield name.decode("latin-1"), data[at + head : at + size]
        at += size


def _kinds(iinf: bytes) -> Iterator[tuple[int, str]]:
    for name, entry in _boxes(iinf, 6 if iinf[0] == 0 else 8):
        if name == "infe" and entry[0] >= 2:
            item = struct.unpack_from(">H" if entry[0] == 2 else ">I", entry, 4)[0]
            at = 8 if entry[0] == 2 else 10
            yield item, entry[at : at + 4].decode("latin-1")


def _references(iref: bytes) -> Iterator[tuple[int, list[int]]]:
    form = "H" if iref[0] == 0 else "I"
    step = struct.calcsize(form)
    for name, entry in _boxes(iref, 4):
        if name == "dimg":
            item, n = struct.unpack_from(f">{form}H", entry)
            yield item, list(struct.unpack_from(f">{n}{form}", entry, step + 2))


def _locations(iloc: bytes) -> Iterator[tuple[int, tuple[bool, list[tuple[int, int]]]]]:
    version = iloc[0]
    sizes = iloc[4] >> 4, iloc[4] & 15, iloc[5] >> 4, (iloc[5] & 15) if version else 0
    at = 6
    wide = 4 if version == 2 else 2

    def number(size: int) -> int:
        nonlocal at
        if at + size > len(iloc):
            raise ValueError("a list beyond its end")
        at += size
        return int.from_bytes(iloc[at - size : at], "big")

    for _ in range(number(wide)):
        item = number(wide)
        method = number(2) & 15 if version else 0
        number(2)
        base = number(sizes[2])
        extents = []
        for _ in range(number(2)):
            number(sizes[3])
            place = number(sizes[0])
            extents.append((base + place, number(sizes[1])))
        yield item, (method == 1, extents)


def _associations(ipma: bytes) -> Iterator[tuple[int, list[int]]]:
    wide = bool(ipma[3] & 1)
    (n,), at = struct.unpack_from(">I", ipma, 4), 8
    for _ in range(n):
        (item,) = struct.unpack_from(">I" if ipma[0] else ">H", ipma, at)
        at += 4 if ipma[0] else 2
        count, at = ipma[at], at + 1
        own = struct.unpack_from(f">{count}{'H' if wide else 'B'}", ipma, at)
        at += count * (2 if wide else 1)
        yield item, [value & (0x7FFF if wide else 0x7F) for value in own]

"""Packets of a recording of which only their places are held, and which are read again as often as they are needed.

In most containers (MP4, MOV, MKV, AVI, MXF, DV) the bytes of a packet lie in the file as they are, behind a header of
a few bytes: each packet is compared with what lies there. In MPEG-TS and PS they lie in pieces, and others state no
place; such packets are written to a file without a name when they are kept for longer. What no file takes is held.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import av

from vidtrack.errors import VidtrackError


@dataclass(frozen=True)
class Limits:
    """header: bytes before a packet's own, at most. begin: bytes by which its own are sought. aside: of a file of
    those put aside; it goes with the last of them."""

    header: int = 64
    begin: int = 16
    aside: int = 8_000_000


LIMITS = Limits()


class KeptPacket:
    """A packet that was read: bytes(...) of it are its own, size says how many, `packet()` is one like it."""

    __slots__ = ("_at", "_dts", "_file", "_held", "_key", "pts", "size")

    def __init__(self, packet: Any) -> None:
        self.size: int = packet.size
        self._held = packet
        self._file: _File | None = None
        self._at, self.pts, self._dts, self._key = 0, packet.pts, packet.dts, packet.is_keyframe

    @property
    def is_held(self) -> bool:
        """Whether its bytes are in memory."""
        return self._file is None

    def lies_in(self, file: _File, at: int) -> None:
        """From now on it is read from there."""
        self._file, self._at, self._held = file, at, None

    def __bytes__(self) -> bytes:
        """Its bytes; VidtrackError where the recording is another one now, or cannot be read any more."""
        return bytes(self._held) if self._file is None else self._file.read(self._at, self.size)

    def packet(self) -> Any:
        """A packet with its bytes and times, as a decoder takes it; raises as `bytes` of it does."""
        if self._held is not None:
            return self._held
        packet = av.Packet(bytes(self))
        packet.pts, packet.dts, packet.is_keyframe = self.pts, self._dts, self._key
        return packet


class KeptPackets:
    """The packets of one recording that are kept; path is its file."""

    def __init__(self, path: str) -> None:
        self._path, self._used = path, 0
        self._aside: _File | None = None
        self._file: _File | None = None
        with suppress(OSError):
            self._file = _File(os.open(path, os.O_RDONLY), path)

    def keep(self, packet: Any) -> KeptPacket:
        """The packet; its bytes are not held where they lie in the file as they are."""
        kept = KeptPacket(packet)
        if self._file is not None and packet.pos is not None and packet.pos >= 0 and not _has_more(packet):
            with suppress(OSError):
                there = self._file.part(packet.pos, packet.size + LIMITS.header)
                data = bytes(packet)
                begin = there.find(data[: LIMITS.begin])
                if begin >= 0 and there.startswith(data, begin):
                    kept.lies_in(self._file, packet.pos + begin)
        return kept

    def put_aside(self, some: Iterable[KeptPacket]) -> None:
        """Write those whose bytes are held to a file, as far as one can be written."""
        for kept in some:
            if not kept.is_held or _has_more(kept.packet()):
                continue
            try:
                if self._aside is None or self._used > LIMITS.aside:
                    number, name = tempfile.mkstemp()
                    self._aside, self._used = _File(number, self._path), 0
                    os.unlink(name)
                written = os.pwrite(self._aside.number, bytes(kept), self._used)
            except OSError:  # no room, no such folder
                return
            if written == kept.size:
                kept.lies_in(self._aside, self._used)
            self._used += written


class _File:
    """An open file, closed when no packet needs it any more. path: of the recording, for messages."""

    def __init__(self, number: int, path: str) -> None:
        self.number, self._path = number, path

    def part(self, at: int, size: int) -> bytes:
        """Bytes from a place on, fewer at the end of the file. No place is moved: another process may read too."""
        return os.pread(self.number, size, at)

    def read(self, at: int, size: int) -> bytes:
        """So many bytes; VidtrackError where they are not there any more."""
        try:
            data = self.part(at, size)
        except OSError as error:
            raise VidtrackError(f"{self._path}: cannot be read again ({error.strerror}). Check the disk.") from None
        if len(data) < size:
            raise VidtrackError(f"{self._path}: became shorter while it was read. Copy it first, then run again.")
        return data

    def __del__(self) -> None:
        with suppress(OSError):
            os.close(self.number)


def _has_more(packet: Any) -> bool:
    """Whether more than its bytes and times says how it is decoded."""
    return (
        packet.is_corrupt
        or packet.is_discard
        or any(beside.data_type != "mpegts_stream_id" for beside in packet.iter_sidedata())
    )

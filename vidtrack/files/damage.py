"""What became of a recording while it was read: damage, gaps in time, pictures that show nothing.

A decoder hides most damage: it fills in from the picture before and says so, at best, in its log. So three things
are watched: packets that it refuses, errors that it logs (they belong to the packet in hand, or with several
threads to one of the last few), and the time stamps, in which a lost picture leaves a gap. Whatever was decoded
from a damaged picture, up to the next key frame, is suspect too, unless the damaged one was a B picture, which
others seldom build on.
"""

from __future__ import annotations

from array import array
from collections import deque
from typing import Any

import numpy as np

from vidtrack.timing.frame import Luma, ReadAccount, VideoInfo

_EVERY = 31
"""One picture in so many is looked at and compared with the next: 0.02 ms a picture at 1080p. Odd, so that it does not
fall in step with pictures that a change of frame rate repeated."""

_B = 3
"""AV_PICTURE_TYPE_B, of pictures that others seldom build on."""

_TELL = 3
"""How many places of damage an account names before it only counts."""


class Watch:
    """Keeps count while a recording is read, at a cost that hides behind the decoder."""

    def __init__(self, in_hand: int) -> None:
        """in_hand  how many packets the decoder may be at work on at once"""
        self._recent: deque[int | None] = deque(maxlen=in_hand)
        self._suspects: dict[int, tuple[int, ...]] = {}  # time stamp -> those of the damage that it may come from
        self._wake: list[int] = []  # damage that what is decoded now may build on
        self._harmless: set[int] = set()
        self._shown_corrupt = False
        self._times = array("d")
        self._corrupt = array("q")
        self._refused = self._backwards = self._other_size = 0
        self._said = ""
        self._broken_off = ""
        self._looked = self._blank = self._compared = self._repeated = 0
        self._before: Luma | None = None

    def sent(self, pts: int | None, key: bool) -> None:
        """A packet goes to the decoder."""
        self._recent.append(pts)
        if key:
            self._wake.clear()
        elif self._wake and pts is not None:
            self._suspects[pts] = tuple(self._wake)

    def complained(self, why: str, *, refused: bool) -> None:
        """The decoder logged an error while it worked on the last packets, or refused the last one altogether."""
        self._said = self._said or why.strip()
        self._refused += refused
        origins = [pts for pts in self._recent if pts is not None]
        self._wake += origins
        self._suspects.update({pts: (*self._suspects.get(pts, ()), pts) for pts in origins})

    def broken_off(self, error: Exception) -> None:
        """The container could not be read at some place."""
        self._broken_off = getattr(error, "strerror", None) or str(error)

    def other_size(self) -> None:
        """A picture of another size than the first, which is left out."""
        self._other_size += 1

    def is_suspect(self, picture: Any) -> bool:
        """Whether a decoded picture is damaged, or built on one that is."""
        corrupt = bool(picture.is_corrupt)
        if not (corrupt or self._suspects or self._shown_corrupt):
            return False
        pts = picture.pts
        origins = self._suspects.pop(pts, ())
        if pts in origins and picture.pict_type == _B:
            self._harmless.add(pts)
            self._wake = [origin for origin in self._wake if origin != pts]
        if picture.key_frame:
            self._shown_corrupt = False
        found = corrupt or self._shown_corrupt or any(at == pts or at not in self._harmless for at in origins)
        # some damage is told by the picture alone: what comes after it in time up to the next key frame is suspect
        self._shown_corrupt = self._shown_corrupt or (corrupt and picture.pict_type != _B)
        return found

    def picture(self, index: int, time: float, luma: Luma, corrupt: bool) -> None:
        """One picture that was decoded and is given on."""
        if self._times and time <= self._times[-1]:
            self._backwards += 1
        self._times.append(time)
        if corrupt:
            self._corrupt.append(index)
        if self._before is not None:
            self._compared += 1
            self._repeated += np.array_equal(self._before, luma)
            self._before = None
        if index % _EVERY == 0:
            low, high = int(luma.min()), int(luma.max())
            self._looked += 1
            self._blank += high - low <= max(8, high // 32)
            self._before = luma.copy()

    def anything(self) -> bool:
        """Whether anything at all has gone wrong so far."""
        return bool(self._said or self._broken_off)

    def reason(self) -> str:
        """The first thing that went wrong, for an error message; empty when nothing did."""
        said = self._said or self._broken_off
        return f" ({said})" if said else ""

    def account(self, info: VideoInfo, *, ended: bool = True) -> ReadAccount:
        """The whole story, one line for each thing that a person should know.

        ended  whether reading came to the end of the file: where somebody stopped before, nothing is missing there
        """
        times = np.array(self._times)
        base = info.time.fitted(times)
        gaps = _gaps(times, float(base.rate)) if base.constant else {}
        cut = _missing_at_end(times, info, float(base.rate)) if ended else 0
        n, corrupt = len(times), len(self._corrupt)
        told = [
            _count(self._refused, "packet refused by the decoder", "packets refused by the decoder") + self.reason()
            if self._refused
            else "",
            f"the file could not be read everywhere ({self._broken_off})" if self._broken_off else "",
            _count(corrupt, "picture is damaged", "pictures are damaged") + _where(self._corrupt.tolist(), "frame")
            if corrupt
            else "",
            _count(sum(gaps.values()), "picture is missing", "pictures are missing")
            + _where(list(gaps), "before frame")
            if gaps
            else "",
            f"the recording ends {cut} pictures before its header says: it is cut off, or the header is wrong"
            if cut
            else "",
            _count(self._backwards, "time stamp does", "time stamps do") + " not move forward"
            if self._backwards
            else "",
            _count(self._other_size, "picture", "pictures") + " of another size left out" if self._other_size else "",
            *self._shows_nothing(n),
        ]
        return ReadAccount(n, sum(gaps.values()) + cut, corrupt, tuple(line for line in told if line))

    def _shows_nothing(self, n: int) -> list[str]:
        told = []
        if self._looked and self._blank == self._looked:
            told.append(f"the picture is blank in all {self._looked} of {n} pictures looked at: nothing was recorded")
        elif self._compared >= 2 and self._repeated == self._compared:
            told.append("the same picture over and over: the recording, or its playback, was stuck")
        elif self._compared >= 5 and self._repeated > 0.15 * self._compared:
            share = round(100 * self._repeated / self._compared)
            told.append(
                f"about {share} % of the pictures repeat the one before: a converted frame rate, or a stuck player"
            )
        return told


def _gaps(times: np.ndarray[Any, np.dtype[np.float64]], rate: float) -> dict[int, int]:
    """Frame -> how many pictures are missing before it, from the time stamps of constant-rate video."""
    missing = np.rint(np.diff(times) * rate).astype(int) - 1
    return {int(at) + 1: int(missing[at]) for at in np.flatnonzero(missing > 0)}


def _missing_at_end(times: np.ndarray[Any, np.dtype[np.float64]], info: VideoInfo, rate: float) -> int:
    if info.is_still or info.duration is None or not len(times):
        return 0
    missing = (float(info.duration) - float(times[-1])) * rate - 1
    return round(missing) if missing > 1.5 else 0  # one frame more or less is rounding, or a repeated last stamp


def _count(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"


def _where(frames: list[int], word: str) -> str:
    """ ": frames 3, 5 to 9 and so on": runs of frames, the first few of them."""
    runs: list[tuple[int, int]] = []
    for frame in frames:
        if runs and frame == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], frame)
        else:
            runs.append((frame, frame))
    told = [f"{a}" if a == b else f"{a} to {b}" for a, b in runs[:_TELL]]
    return f" ({word} {', '.join(told)}{f' and {len(runs) - _TELL} places more' if len(runs) > _TELL else ''})"

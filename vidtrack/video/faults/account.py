"""How a recording was read: gaps in time, damage, pictures that show nothing, in words.

Every picture's time is kept (8 bytes), a few pictures are looked at and compared with the next.
"""

from __future__ import annotations

from array import array
from dataclasses import replace
from typing import Any

import numpy as np

from vidtrack.timing.frame import BLANK, Luma, ReadAccount, VideoInfo
from vidtrack.video.faults.damage import DamageWatch

_EVERY = 31
"""One picture in so many is looked at and compared with the next: 0.02 ms a picture at 1080p. Odd, so that it does not
fall in step with pictures that a change of frame rate repeated."""

_EARLY, _BEGINNING = 7, 62
"""At the beginning more often, so that short recordings are looked at too."""

_DARK = 5.0
"""Grey levels, standard deviation over a picture, up to which it may show nothing but noise."""

_STANDS_OUT = 8.0
"""Standard deviations of a picture's levels by which anything that is seen in it stands out."""

_CODING = 12.0
"""Of 255, share of the greatest level by which codecs let the same picture differ from one frame to the next."""

_LISTED_AT_MOST = 3
"""How many places of damage an account names before it only counts."""

NO_STAMP = -(2**63)


class ReadingLog:
    """Keeps count while a recording is read, at a cost that hides behind the decoder."""

    def __init__(self) -> None:
        self._notes: list[str] = []
        self.times = array("d")
        """s, of each picture given."""
        self.packets = array("q")
        """Time stamps of their packets."""
        self.corrupt = array("q")
        """Numbers of those flagged."""
        self._backwards = self._other_size = 0
        self.could_not_read = ""
        self._seen = array("d")  # least, greatest, mean level and standard deviation of each picture looked at
        self._compared = array("q")  # pictures compared with the next
        self._alike = array("b")  # 2 the very same, 1 but for what coding does, 0 not
        self._before: Luma | None = None

    def broken_off(self, error: Exception) -> None:
        """The container could not be read at some place."""
        self.could_not_read = getattr(error, "strerror", None) or str(error)

    def noted(self, what: str) -> None:
        """Something else that a person should know of the recording."""
        self._notes.append(what)

    def other_size(self) -> None:
        """A picture of another size than the first, which is left out."""
        self._other_size += 1

    def reason(self, damage: DamageWatch) -> str:
        """The first thing that went wrong, for an error message; empty when nothing did."""
        said = damage.said or self.could_not_read
        return f" ({said})" if said else ""

    def picture(self, index: int, time: float, luma: Luma, corrupt: bool, packet: int | None = None) -> None:
        """One picture that was decoded and is given on; packet: the time stamp of its packet."""
        if self.times and time <= self.times[-1]:
            self._backwards += 1
        self.times.append(time)
        self.packets.append(NO_STAMP if packet is None else packet)
        if corrupt:
            self.corrupt.append(index)
        if self._before is not None:
            self._compared.append(index - 1)
            self._alike.append(_alikeness(self._before, luma))
            self._before = None
        if index % (_EARLY if index < _BEGINNING else _EVERY) == 0 or index == _EVERY:
            some = luma[:: 1 + luma.size // 40_000]
            self._seen.extend((float(luma.min()), float(luma.max()), float(some.mean()), float(some.std())))
            self._before = luma.copy()

    def account(self, info: VideoInfo, damage: DamageWatch, *, ended: bool = True) -> ReadAccount:
        """The whole story, one line for each thing that a person should know.

        ended  whether reading came to the end of the file: where reading stopped before, nothing is missing there
        """
        times = np.array(self.times)
        base = replace(info.time, tick=0.0).fitted(times)  # stamps that scatter show gaps all the same
        gaps = _gaps(times, float(base.rate)) if base.constant else {}
        if n_first := round(times[0] * float(base.rate)) if len(times) else 0:
            gaps = {0: n_first, **gaps}
        cut = _missing_at_end(times, info, float(base.rate)) if ended else 0
        n, corrupt = len(times), len(self.corrupt)
        lines = [
            *self._notes,
            _count(damage.refused, "packet refused by the decoder", "packets refused by the decoder")
            + self.reason(damage)
            if damage.refused
            else "",
            f"the file could not be read everywhere ({self.could_not_read})" if self.could_not_read else "",
            _count(corrupt, "picture is damaged", "pictures are damaged") + _where(self.corrupt.tolist(), "frame")
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
            *self._shows_nothing(n, info.bits),
        ]
        return ReadAccount(n, sum(gaps.values()) + cut, corrupt, tuple(line for line in lines if line))

    def _shows_nothing(self, n: int, bits: int) -> list[str]:
        lines = []
        if self._seen and _blank(np.reshape(self._seen, (-1, 4)), bits).all():
            looked = len(self._seen) // 4
            lines.append(f"{BLANK} in all {looked} of {n} pictures looked at: a covered lens, or very faint targets")
        elif stuck := _stuck(np.array(self._compared), np.array(self._alike)):
            lines.append(stuck)
        return lines


def _alikeness(before: Luma, now: Luma) -> int:
    """2 for the very same picture, 1 where only coding differs: the noise, too, is that of before; else 0."""
    if np.array_equal(before, now):
        return 2
    some = slice(None, None, 1 + before.size // 40_000)
    a, b = before[some].astype(np.float32), now[some].astype(np.float32)
    if np.abs(a - b).sum() > 0.5 * np.abs(np.diff(a, axis=1)).sum():
        return 0
    off = np.maximum(before, now) - np.minimum(before, now)
    return int(off.max() <= _CODING / 255 * int(now.max()))


def _blank(seen: np.ndarray[Any, np.dtype[np.float64]], bits: int) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Whether pictures (least, greatest, mean level, standard deviation) show nothing, or nothing but noise."""
    low, high, mean, sd = seen.T * 255.0 / (2**bits - 1)
    noise = (sd <= _DARK) & (np.maximum(high - mean, mean - low) <= _STANDS_OUT * sd)
    return np.asarray((high - low <= 8) | noise)


def _stuck(at: np.ndarray[Any, np.dtype[np.int64]], alike: np.ndarray[Any, np.dtype[np.int8]]) -> str:
    """What is to be said of pictures `at` that are like the next; nothing where they change as pictures do."""
    if np.count_nonzero(at % _EVERY == 0) >= 5:
        alike, at = alike[at % _EVERY == 0], at[at % _EVERY == 0]
    if len(at) < 2:
        return ""
    if (alike == 2).all():
        return "the same picture over and over: the recording, or its playback, was stuck"
    if alike.all():
        return "nothing changes from picture to picture: the recording was stuck, or everything in it is at rest"
    begins = int(np.argmax(alike > 0))
    if begins and np.count_nonzero(alike) >= 3 and np.mean(alike[begins:] > 0) > 0.8:  # key frames are coded anew
        return (
            f"nothing changes from picture to picture from about frame {at[begins]} on: the recording got stuck, "
            "or everything in it came to rest"
        )
    repeated = float(np.mean(alike == 2))
    if len(at) >= 5 and repeated > 0.15:
        return (
            f"about {100 * repeated:.0f} % of the pictures repeat the one before: "
            "a converted frame rate, or a stuck player"
        )
    return ""


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
    places = [f"{a}" if a == b else f"{a} to {b}" for a, b in runs[:_LISTED_AT_MOST]]
    more = f" and {len(runs) - _LISTED_AT_MOST} places more" if len(runs) > _LISTED_AT_MOST else ""
    return f" ({word} {', '.join(places)}{more})"

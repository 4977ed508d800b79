"""Pictures whose damage shows in no flag of the decoder: the still background leaves all at once, and comes back.

A decoder that meets noise inside a slice decodes it to garbage and goes on. A fixed camera shows it: many scattered
blocks of the background, which were still, differ from the picture before by far more than they usually do, and after
one picture (in codecs that code each picture by itself) or with the next key frame, just as suddenly, they are what
they were. Targets do so in few blocks and never in all of them at once, light in the same way over all of the picture;
what crosses the picture is not where it began when it leaves; a camera that shakes moves all that it shows.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import NamedTuple

import cv2
import numpy as np

from vidtrack.arrays import Array, Bools
from vidtrack.timing.frame import Coded, Frame, Luma
from vidtrack.tracking.following.record import Others
from vidtrack.tracking.pictures.few_pixels import by_block, every, step_of
from vidtrack.tracking.pictures.shaken import explained
from vidtrack.tracking.pictures.stepwise_changes import StepwiseChanges, around
from vidtrack.tracking.state import CORRUPT, PREDICTED, Rows


@dataclass(frozen=True)
class Limits:
    """What counts as damage; grey levels are of 255.

    change, times  grey levels, mean over a block, and multiples of what is usual, that a block changes in one picture
    blocks         that do so at once, at least
    crowd          and multiples of how many usually do
    few, more      blocks, and multiples of how many usually do and did last, at which a picture gets a second look
    doubts         pictures of each kind that get one, at most: those in which most blocks changed
    gap            so many times as late as others a picture comes, where those before it were lost
    memory         share of the latest picture in what is usual
    back, returned  share of its change that a block may be off when it is back; share of the blocks that are back
    own            share of the blocks that changed first that leave and come back with them
    hits           pictures, built on no others, that are damaged one behind the other
    shaken         share of what is back that the camera's motion explains
    group          pictures of a group that are remembered, for what is built on damage
    kept           pictures from before a change that are kept at once, to be compared with
    nothing        grey levels, standard deviation of a picture that shows nothing
    light          share of the change, at least, that one gain and one offset explain where it is light
    """

    change: float = 4.0
    times: float = 4.0
    blocks: int = 5
    crowd: float = 3.0
    few: int = 3
    more: float = 2.0
    doubts: int = 16
    gap: float = 1.5
    memory: float = 0.1
    own: float = 0.6
    hits: int = 3
    shaken: float = 0.5
    near: float = 2.0
    back: float = 0.4
    returned: float = 0.6
    kept: int = 12
    group: int = 600
    nothing: float = 2.0
    light: float = 0.6
    gain: float = 0.5
    one_way: float = 0.9


LIMITS = Limits()
LOSSLESS = ("ffv1", "ffvhuff", "huffyuv", "magicyuv", "rawvideo", "utvideo")


def without_damaged(rows: Rows, damaged: Bools) -> Rows:
    """The rows with nothing measured in damaged samples (k,), flagged so."""
    if not damaged.any():
        return rows
    values = np.where(damaged[:, None], np.nan, rows.values)
    return rows._replace(values=values, flag=np.where(damaged[:, None], CORRUPT | PREDICTED, rows.flag))


def kept_others(others: Others, damaged: Bools) -> Others:
    """What else was followed, without its samples in damaged pictures (k,)."""
    if not damaged.any():
        return others
    good = ~damaged[others.sample]
    return Others(others.track[good], others.sample[good], others.values[:, good], others.flag[good])


class _Change(NamedTuple):
    """What the background was before it changed, and from which picture on it is otherwise.

    first   index of that picture
    before  (h, w) grey levels of the pixels looked at
    blocks  (h/4, w/4) which changed
    """

    first: int
    before: Luma
    blocks: Bools


class _New(NamedTuple):
    """Blocks that changed far from those that did in the picture before; limit: of their change, grey levels."""

    first: int
    before: Luma
    blocks: Bools
    limit: Array


class _Now(NamedTuple):
    """A picture in which unusually much changed.

    whole      the picture before
    few, last  the pixels looked at of this one and of that
    out        (h/4, w/4) blocks that changed; change: by how much, grey levels
    """

    frame: Frame
    whole: Luma
    few: Luma
    last: Luma
    out: Bools
    change: Array


LookAgain = Callable[[Sequence[int]], set[int]]
"""From frames that changed suddenly, the most doubtful first, to those, of all, that a second look found damaged
(`Video.look_again`)."""


class DamagedPictures:
    """Looks at each frame that passes; `indices`: of frames that were found to be damaged, and not flagged so;
    `copied`: whether any was coded by what differs from others, so that it copies their errors.

    codec       FFmpeg's name; one that loses nothing makes no errors, though it may call its pictures built on others
    look_again  asked, when all frames have passed, for those in which much changed, or which precede flagged ones
    """

    def __init__(self, bits: int, look_again: LookAgain | None = None, codec: str = "") -> None:
        self.indices: set[int] = set()
        self.copied = False
        self._lossless = codec in LOSSLESS
        self._doubtful: dict[int, float] = {}  # frame -> how many times as many blocks changed as expected at most
        self._faint = dict[int, float]()  # of other frames the same, by blocks far from those of the picture before
        self._in_steps = dict[int, float]()  # of those up to which the background changed in steps
        self._single = dict[int, float]()  # frame -> times its limit that a block far from those changed, and stays
        self._kinds = self._doubtful, self._faint, self._in_steps, self._single
        self._is_elsewhere = False
        self._new: _New | None = None
        self._steps = StepwiseChanges(by_block)
        self._look_again = look_again
        self._shift = bits - 8
        self._last: Luma | None = None
        self._whole: Luma | None = None  # the latest picture, of which _last has a part
        self._seen: list[tuple[int, Coded | None]] = []  # frames looked at since the earliest change kept
        self._keys: deque[int] = deque(maxlen=LIMITS.hits + 1)  # of them, the latest that are built on no others
        self._usual: Array | None = None
        self._crowd, self._many = 0.0, np.inf  # blocks that usually change, and that did in the latest picture
        self._apart = 0.0  # of them, far from those of the picture before
        self._out: Bools | None = None  # blocks that changed in the latest picture
        self._changes: list[_Change] = []
        self._group: deque[tuple[int, Coded]] = deque(maxlen=LIMITS.group)  # good frames since the latest key frame
        self._spreads = False  # damage that was found, to the next key frame

    def over(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """The frames, unchanged; at their end, what is doubtful is looked at again."""
        yield from self.monitored(frames)
        most = (sorted(kind, key=lambda i: -kind[i])[: LIMITS.doubts] for kind in self._kinds)
        asked = dict.fromkeys(i for those in zip_longest(*most) for i in those if i is not None)
        if self._look_again and asked:
            self.indices |= self._look_again(list(asked))

    def monitored(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """As `video.monitored.Monitor`."""
        good, pace, latest = None, np.inf, -np.inf
        for frame in frames:
            self.copied |= frame.coded is not None and not (frame.coded.key or self._lossless)
            if self._is_elsewhere:
                yield frame
                continue
            gap, latest = float(frame.time) - latest, float(frame.time)
            pace = min(pace, gap) if gap > 0 else pace  # stamps may repeat
            if good is not None and gap > LIMITS.gap * pace:
                self._faint[good] = gap / pace  # what is lost behind it may begin in it
            if not frame.corrupt:
                self._look(frame)
                good = frame.index
            elif good is not None:
                self._doubtful[good] = np.inf
                good = None
            self._note(frame)
            yield frame

    def elsewhere(self) -> None:
        """As `video.monitored.Monitor`."""
        self._is_elsewhere = True

    def seen(self) -> tuple[set[int], tuple[dict[int, float], ...]]:
        """As `video.monitored.Monitor`."""
        return self.indices, self._kinds

    def taken(self, seen: tuple[set[int], tuple[dict[int, float], ...]]) -> None:
        """As `video.monitored.Monitor`."""
        self.indices |= seen[0]
        for own, new in zip(self._kinds, seen[1], strict=True):
            own.update(new)

    def as_record(self) -> dict[str, list[int]]:
        """What is to be recorded of it: nothing where no picture is damaged."""
        return {"damage_seen": sorted(self.indices)} if self.indices else {}

    def _look(self, frame: Frame) -> None:
        few = self._few(frame.luma)
        last, self._last = self._last, few
        whole, self._whole = self._whole, frame.luma
        self._seen.append((frame.index, frame.coded))
        if frame.coded is None or frame.coded.key:
            self._keys.append(frame.index)
        if (most := self._steps.seen(few, frame.coded)) >= 1:
            self._in_steps[frame.index] = most
        if last is None or whole is None or last.shape != few.shape:
            self._usual, self._out, self._changes, self._seen = None, None, [], [(frame.index, frame.coded)]
            self._faint[frame.index] = 1.0  # before it there is none to compare with
            return
        change = by_block(few, last)
        if self._usual is None:
            self._usual = np.ones_like(change)
        usual = self._usual
        limit = np.maximum(LIMITS.change, LIMITS.times * usual)
        out = change > limit
        usual += LIMITS.memory * (np.minimum(change, 2 * usual + 1) - usual)
        many = int(np.count_nonzero(out))
        unusual = many >= LIMITS.blocks + LIMITS.crowd * self._crowd
        expected = LIMITS.few + LIMITS.more * max(self._crowd, self._many)
        new = np.zeros_like(out) if self._out is None else out & ~around(self._out)
        apart = int(np.count_nonzero(new))
        self._many, self._out = many, out
        if many >= expected:
            self._doubtful[frame.index] = many / expected
        elif (most := apart / (LIMITS.few + LIMITS.more * self._apart)) >= 1:
            self._faint[frame.index] = most
        self._stay(frame.index, few, last, out)
        if self._new is None and apart and frame.index not in self._doubtful and frame.index not in self._faint:
            self._new = _New(frame.index, last, new, limit)
        self._apart += LIMITS.memory * (min(apart, 2 * self._apart + LIMITS.few) - self._apart)
        self._crowd += LIMITS.memory * (min(many, 2 * self._crowd + LIMITS.blocks) - self._crowd)
        if unusual:
            self._returned(_Now(frame, whole, few, last, out, change))
            self._changes = [*self._changes[-LIMITS.kept + 1 :], _Change(frame.index, last, out)]
        if len(self._keys) > LIMITS.hits:  # what is older than so many of them has come to stay, see _can_end
            self._changes = [one for one in self._changes if one.first > self._keys[0]]
        first = self._changes[0].first if self._changes else frame.index
        while self._seen[0][0] < first:
            self._seen.pop(0)

    def _stay(self, index: int, few: Luma, last: Luma, out: Bools) -> None:
        """Whether blocks that were new in the picture before stay as they were there."""
        new, self._new = self._new, None
        if new is not None and (stay := new.blocks & ~out).any():
            by = by_block(few, new.before)[stay] / new.limit[stay]
            if (most := float(by.max())) > 1:
                self._single[new.first] = most

    def _returned(self, now: _Now) -> None:
        """Find changes that are undone by this picture, and note those that were before it."""
        enough = max(LIMITS.blocks, LIMITS.returned * int(np.count_nonzero(now.out)))
        for j, one in enumerate(self._changes):
            between = [coded for index, coded in self._seen[:-1] if index >= one.first]
            if not _can_end(between, now.frame.coded):
                continue
            here, gone = by_block(now.few, one.before), by_block(now.last, one.before)
            back = now.out & (here < np.maximum(LIMITS.near, LIMITS.back * now.change))
            again = one.blocks & (gone > LIMITS.change) & (here < np.maximum(LIMITS.near, LIMITS.back * gone))
            enough_back = np.count_nonzero(back) >= enough and np.count_nonzero(back[1:-1, 1:-1]) >= LIMITS.blocks
            all_back = np.count_nonzero(again) >= LIMITS.own * np.count_nonzero(one.blocks)
            if enough_back and all_back and not _is_light(now.last, now.few, back) and not self._is_shaken(now, back):
                self.indices.update(index for index, _ in self._seen[:-1] if index >= one.first)
                self._spread(between, now.frame)
                self._changes = self._changes[:j]
                return

    def _spread(self, damaged: Sequence[Coded | None], now: Frame) -> None:
        """Note what is built on damaged pictures: less of it may be seen than of themselves."""
        origins = [coded for coded in damaged if coded is not None and not coded.alone]
        if now.coded is None or not origins:
            return
        origin = min(origins)
        self.indices.update(i for i, coded in self._group if coded >= origin and coded.group == origin.group)
        self._spreads = not now.coded.key and now.coded > origin

    def _is_shaken(self, now: _Now, back: Bools) -> bool:
        """Whether the camera's motion alone brings back most of some blocks."""
        before, after = (
            p if self._shift <= 0 else (p >> self._shift).astype(np.uint8) for p in (now.whole, now.frame.luma)
        )
        by_motion = explained(before, after, 4 * step_of(after), back.shape)
        return int(np.count_nonzero(by_motion & back)) > LIMITS.shaken * int(np.count_nonzero(back))

    def _note(self, frame: Frame) -> None:
        """Keep the frame's place in the order of coding; it is damaged where what was found spreads."""
        if frame.coded is None:
            return
        if frame.coded.key:
            self._group.clear()
            self._spreads = False
        if not frame.corrupt:
            self._group.append((frame.index, frame.coded))
            if self._spreads:
                self.indices.add(frame.index)

    def _few(self, luma: Luma) -> Luma:
        few = every(luma, step_of(luma))
        return few if self._shift <= 0 else (few >> self._shift).astype(np.uint8)


def _can_end(damaged: Sequence[Coded | None], now: Coded | None) -> bool:
    """Whether damage may lie in these pictures and end before picture `now`.

    It ends with a key frame, behind pictures that nothing is built on, or with one that was coded before it. In
    each key frame it is another damage.
    """
    if sum(coded is None or coded.key for coded in damaged) > LIMITS.hits:
        return False
    origins = [coded for coded in damaged if coded is not None and not coded.alone]
    if now is None or now.key or not origins:
        return True
    return now.group > max(one.group for one in origins) or now.number < min(one.number for one in origins)


def _is_light(before: Luma, after: Luma, blocks: Bools) -> bool:
    """Whether some blocks became brighter, or darker, all of them, with what is seen in them as it was.

    So it is behind a picture that shows nothing, as where a hand covers the lens.
    """
    if float(before.std()) < LIMITS.nothing:
        return True
    where = cv2.resize(blocks.astype(np.uint8), before.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
    x, y = before[where].astype(np.float32), after[where].astype(np.float32)
    by = (y - x).reshape(-1)
    one_way = max(float((by > 0).mean()), float((by < 0).mean())) > LIMITS.one_way
    gain = max(float(np.cov(x, y)[0, 1]) / max(float(x.var()), 1e-3), LIMITS.gain)
    return one_way and float((y - gain * x).var()) < (1 - LIMITS.light) * float((by**2).mean())

"""A recording as it is tracked: its opening, its field order, its grey levels, the samples of its frames."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import Any, NamedTuple

import cv2
import numpy as np

from vidtrack.arrays import Bools, Ints
from vidtrack.errors import VidtrackError
from vidtrack.timing.fields import chosen_order, order_from_pictures, split
from vidtrack.timing.frame import Frame, Luma, VideoInfo
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.contrast_stretch import LEVELS, Stretch, stretch
from vidtrack.tracking.detection.threshold import THRESHOLD, automatic, background_level, noise_sd, sample
from vidtrack.tracking.initiation.trails import LINKING
from vidtrack.tracking.sample import Sample


@dataclass(frozen=True)
class Opening:
    """How a clip is opened.

    grainy    grey levels of noise above which a part of it may be a still grain of the scene
    frames    that a clip is opened with; more: of them that are read where some are damaged or show nothing, at most
    even      of the widest range of levels of a picture, below which another one may show nothing
    alike     factor by which the noise of a picture differs from that of the others at most: a black one, or one that
              was never decoded, says nothing of the recording
    examined  frames of it in which the order of fields is looked for
    combed    by how much the fields of a frame must differ, as `Order` has it, before a flag that says that they were
              taken at once is overruled
    moving    of the greatest change from frame to frame, from which on a column counts as moving; columns: at most
    """

    grainy: float = 5.0
    frames: int = 12
    more: int = 60
    even: float = 0.25
    alike: float = 2.0
    examined: int = 16
    combed: float = 0.4
    moving: float = 0.3
    columns: int = 240


OPENING = Opening()


class DetectSettings(NamedTuple):
    """The settings by which targets are distinguished from the background, as `track` takes them."""

    polarity: str
    threshold: float | str
    centroid: Any
    min_pixels: int
    fields: str
    gain: Any
    offset: Any
    max_step: float = Detection.max_step
    min_motion: float = Detection.min_motion
    max_clutter: float = Detection.max_clutter
    max_occlusion: int = Detection.max_occlusion


class Clip:
    """A recording as it is tracked.

    opening, batches  frames that were read to begin with, `most` at most, and those to come; stretched where needed
    repeated   indices of frames that repeat the one before; it may grow while frames are read
    order      "frame", or the field that comes first
    detection  for its samples; level: the clip's threshold, grey level of pictures turned bright
    """

    def __init__(
        self,
        batches: Iterator[list[Frame]],
        info: VideoInfo,
        detect: DetectSettings,
        repeated: Container[int] = (),
        most: int = OPENING.frames + OPENING.more,
    ) -> None:
        self.opening, self._even, self.batches = *_opened(batches, info.bits, most), batches
        if not self.opening:
            raise VidtrackError("the recording has no frame to track in. Give one that has.")
        self._repeated = repeated
        self._info, self._settings = info, detect
        self._levels = self._wanted(info, detect)
        self._typical, self._noise = self._like_the_others()
        self._stretch()
        self.order, self._why = field_order(detect.fields, info, self._whole())
        self._judge()

    def read_on(self, most: int) -> None:
        """Take more frames into the opening, `most` in all or a few more."""
        self.opening = _more(self.opening, self.batches, most)
        self._even = _even(self.opening, self._info.bits)
        if self._levels is None:
            self._levels = self._wanted(self._info, self._settings)
            if self._levels is not None:
                self._stretch()
                self._judge()

    def samples(self, frames: Sequence[Frame]) -> list[Sample]:
        """Samples in order of time: one a frame, or its two fields."""
        rate = float(self._info.rate)
        if self.order == "frame":
            return [Sample(f.luma, float(f.time) * rate, 0, 1, f.corrupt, f.index in self._repeated) for f in frames]
        fields = ((f, field) for f in frames for field in split(f.luma, self.order))
        return [
            Sample(d.luma, 2 * (float(f.time) * rate + d.offset), d.parity, 2, f.corrupt, f.index in self._repeated)
            for f, d in fields
        ]

    def shown(self) -> tuple[list[Sample], Ints]:
        """The opening's samples in pictures that show something, and their places in it; all where there are few."""
        samples, lines = self.samples(self.opening), 1 if self.order == "frame" else 2
        order = np.flatnonzero(np.repeat(~self._even, lines))
        if order.size < LINKING.shortest * lines:
            order = np.arange(len(samples))
        return [samples[k] for k in order.tolist()], order

    def _whole(self) -> list[Frame]:
        """The opening's frames that show something; all of them where none does."""
        return [self.opening[k] for k in self._places()]

    def _places(self) -> list[int]:
        return np.flatnonzero(~self._even | self._even.all()).tolist()

    def _like_the_others(self) -> tuple[int, float]:
        """The place of the first frame that shows something and is as noisy as others, and its noise, grey levels."""
        noise = np.array([noise_sd(one.luma, scale=255.0 / (2**self._info.bits - 1)) for one in self._whole()])
        usual = float(np.median(noise))
        k = int(np.argmax((noise * OPENING.alike >= usual) & (noise <= usual * OPENING.alike)))
        return self._places()[k], float(noise[k])

    def as_record(self) -> dict[str, Any]:
        """How it is seen, for the diagnostics."""
        gain, offset = (self._levels.gain, self._levels.offset) if self._levels else (1.0, 0.0)
        return {
            "fields": self._why,
            "noise": self.detection.noise,
            "threshold": self.level,
            "stretch": {"gain": gain, "offset": offset},
        }

    def _wanted(self, info: VideoInfo, detect: DetectSettings) -> Stretch | None:
        """The stretch of grey levels that the opening needs."""
        whole = [frame.luma for frame in self._whole()]
        return stretch(whole, info.bits, dark=detect.polarity == "dark", gain=detect.gain, offset=detect.offset)

    def _stretch(self) -> None:
        """Pass all frames through the stretch, if one is wanted."""
        levels = self._levels
        if levels is None:
            return

        def through(frames: list[Frame]) -> list[Frame]:
            return [frame._replace(luma=levels.over(frame.luma)) for frame in frames]

        self.opening, self.batches = through(self.opening), map(through, self.batches)
        self._info, self._noise = replace(self._info, bits=LEVELS.bits), self._noise * levels.gain

    def _flicker(self, scale: float) -> float:
        """How much pixels change from picture to picture, grey levels, where that is plainly less than the noise."""
        samples = self.samples(self._whole())
        pairs = list(zip(samples, samples[samples[0].lines :], strict=False))
        if self._noise < OPENING.grainy or not pairs:
            return 0.0
        a, b = (sample(one.luma, scale) for one in pairs[len(pairs) // 2])
        change = float(np.median(np.abs(a - b))) / (0.6745 * 2**0.5)
        return max(change, self._noise / 4) if change < self._noise / 2 else 0.0

    def _judge(self) -> None:
        """Set detection and level by the first frame that is like the others."""
        full, detect = float(2**self._info.bits - 1), self._settings
        level = None if detect.threshold == "auto" else float(detect.threshold)
        dark = detect.polarity == "dark"
        self.detection = Detection(
            scale=255.0 / full,
            full=full,
            dark=dark,
            threshold=level,
            noise=self._noise,
            flicker=self._flicker(255.0 / full),
            centroid=detect.centroid,
            min_pixels=detect.min_pixels,
            max_step=detect.max_step,
            min_motion=detect.min_motion,
            max_clutter=detect.max_clutter,
            max_occlusion=detect.max_occlusion,
        )
        self.level = _level(self.samples([self.opening[self._typical]])[0], self.detection)


def batches(frames: Iterable[Frame], size: int) -> Iterator[list[Frame]]:
    waiting = iter(frames)
    while batch := list(islice(waiting, size)):
        yield batch


def _more(frames: list[Frame], batches: Iterator[list[Frame]], most: int) -> list[Frame]:
    """The frames with those that follow, `most` in all or a few more."""
    frames = list(frames)
    while len(frames) < most and (batch := next(batches, None)) is not None:
        frames += batch
    return frames


def _opened(batches: Iterator[list[Frame]], bits: int, most: int) -> tuple[list[Frame], Bools]:
    """The first frames, about as many more as some of them show nothing, `most` in all; and which show nothing."""
    frames = _more([], batches, OPENING.frames)
    even, known = _even(frames, bits), 0
    while even.any() and len(frames) > known:
        known = len(frames)
        frames = _more(frames, batches, min(OPENING.frames + min(int(even.sum()), OPENING.more), most))
        even = even if len(frames) == known else _even(frames, bits)
    return frames, even


def _even(frames: Sequence[Frame], bits: int) -> Bools:
    """Which frames (n,) are damaged, or all but even beside others that are not: no target can stand out of them."""
    corrupt = np.array([frame.corrupt for frame in frames], bool)
    extremes = [cv2.minMaxLoc(frame.luma)[:2] for frame in frames]
    span = np.array([high - low for low, high in extremes], float) * 255 / (2**bits - 1)
    most = span[~corrupt].max(initial=0.0)
    return np.asarray(corrupt | (span < min(THRESHOLD.least_contrast, OPENING.even * most)))


def field_order(fields: str, info: VideoInfo, opening: list[Frame]) -> tuple[str, str]:
    """ "frame", or the field that comes first; and why."""
    if fields in ("top", "bottom"):
        return _as_shown(fields, info)
    if fields != "auto":
        return fields, f"fields: {fields}, as set"
    if info.is_still:
        return "frame", "fields: a still"
    if info.field_order == "progressive":
        return _although_progressive([frame.luma for frame in opening[: OPENING.examined]])
    pictures = (frame.luma[:, ::4] for frame in opening[: OPENING.examined])
    order, why = chosen_order(info.field_order, order_from_pictures(pictures))
    return (order if order in ("top", "bottom") else "frame"), why


def _although_progressive(pictures: Sequence[Luma]) -> tuple[str, str]:
    """ "frame", or the field that comes first where pictures that are flagged as progressive are plainly woven.

    Only columns in which something moves are compared: a progressive recording pays for no more.
    """
    motion = order_from_pictures(_moving_columns(pictures))
    if motion.order in ("top", "bottom") and motion.combing > OPENING.combed:
        return chosen_order("progressive", motion)
    return "frame", "fields: progressive, from the flags"


def _moving_columns(pictures: Sequence[Luma]) -> list[Luma]:
    """The pictures, cut to columns in which something moves, at most so many that are spread over them."""
    moves = np.zeros(pictures[0].shape[1] if pictures else 0, bool)
    for before, now in pairwise(pictures):
        change = cv2.absdiff(before, now)
        moves |= cv2.reduce(change, 0, cv2.REDUCE_MAX)[0] > OPENING.moving * max(int(change.max()), 1)
    some = np.flatnonzero(moves)
    some = some[:: max(1, -(-some.size // OPENING.columns))]
    return [picture[:, some] for picture in pictures] if some.size else []


def _as_shown(fields: str, info: VideoInfo) -> tuple[str, str]:
    """The field that comes first in the picture as it is shown, where the config names that of the stored picture.

    Raises VidtrackError for pictures that lie on their side: their fields are columns.
    """
    if info.rotation in (90, 270):
        raise VidtrackError(
            f"detect.fields: {fields}: the file turns its pictures by {info.rotation} degrees, so that their fields "
            "are columns, which are not split. Set fields: frame, or remove the rotation from the file and give "
            "positions in the picture as it lies."
        )
    if info.rotation == 180 and info.height % 2 == 0:
        shown = "bottom" if fields == "top" else "top"
        return shown, f"fields: {fields} first, as set, which is {shown} in the picture turned by 180 degrees"
    return fields, f"fields: {fields}, as set"


def _level(sample: Sample, detection: Detection) -> float:
    """The clip's threshold, grey level of pictures turned bright."""
    if detection.level is not None:
        return detection.level
    image = detection.bright(sample.luma)
    base = background_level(image, scale=detection.scale)
    over = image.astype(np.float32) * np.float32(detection.scale) - np.float32(base)
    return base + automatic(over, detection.noise)

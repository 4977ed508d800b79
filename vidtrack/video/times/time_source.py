"""When a recording was made, by every clock that it carries: which one is used, and how well they agree.

    found = find_time(path, video.info, start_timecode="10:00:00:00")    before the frames are read
    info = replace(video.info, time=found.base)                          from here on, stages use info.time
    found.table                                                          a row for every source, for the report
    found.problems                                                       what a person should know

and once the time stamps of all frames are known (vidtrack.timing.timebase has the rest):

    base = info.time.fitted(times)        times (n,) s, Frame.time: constant or variable rate, by the stamps
    time_s = base.seconds(times, fields)  seconds since midnight of the code; fields 0.5 for second fields
    label = base.labels(times)            (n,) time code labels

Sources, the first that has a label being used, labels of a clock that was never set (00:00:00:00) last:

    ltc       longitudinal time code on a sound track: what the laboratory's generator laid down, a word every frame,
              and the only one that says where between two words a frame lies
    dv        a code in every frame of DV tape; where it jumps (the recorder paused), the time base jumps with it
    tmcd, mxf, matroska, ismp     the container's label of the first frame
    sei, gop  the first picture's own label in the coded stream
    config    the run's start_timecode, for recordings that carry none
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import VideoInfo
from vidtrack.timing.ltc import Reading, Words, chained, code_rate, joined, read_words
from vidtrack.timing.timebase import Anchor, TimeBase, code_rate_of, frames_before, time_base
from vidtrack.timing.timecode import exact_rate, frame_from_label, label_from_frame, parse
from vidtrack.video.container import open_container
from vidtrack.video.sound import sound_blocks, sound_tracks
from vidtrack.video.times.embedded_timecode import ZERO, code_of_dv

_PATIENCE = 3
"""Blocks of 10 s without a word of time code after which a sound track is not searched further."""


class SourceRow(NamedTuple):
    """One source of time: a row of the report's table.

    source  "ltc", "dv", "tmcd", ..., "config"
    label   the time code that it gives to the first frame; "" where it gives none
    off     s by which it is later than the source in use at the first frame; NaN where either has none
    used    whether the time of the run comes from it
    note    what else is to be said: drop-frame, dropouts, jumps, why it could not be used
    """

    source: str
    label: str
    off: float
    used: bool
    note: str


class TimeSource(NamedTuple):
    """The time base of a recording, the table of its sources, and what a person should know."""

    base: TimeBase
    table: tuple[SourceRow, ...]
    problems: tuple[str, ...]


def find_time(path: str, info: VideoInfo, *, start_timecode: str | None = None, sound: bool = True) -> TimeSource:
    """The clock of a recording, from all that it carries.

    info            of the recording, from open_video
    start_timecode  the label of the first frame as the config gives it: the last resort
    sound           whether to search the sound tracks
    Raises VidtrackError for a start_timecode that is no time code at the recording's rate.
    """
    if info.is_still:
        return TimeSource(info.time, (), ())
    bases: dict[str, TimeBase] = {}
    notes: dict[str, str] = {}
    if sound and info.pace == 1 and (reading := longitudinal(path, info)) is not None:
        bases["ltc"], notes["ltc"] = _base_of_reading(reading, info.rate), _note_of(reading)
    if info.codec == "dvvideo" and (base := _base_of_tape(path, info)) is not None:
        bases["dv"], notes["dv"] = base, _jumps(base)
    for source, label in info.timecodes.items():
        try:
            code = parse(label, code_rate_of(info.stated_rate, info.code_bases.get(source)))
            code += -frames_before(source, float(info.first_shown), code.rate)
            bases.setdefault(source, time_base(info.rate, code, source=source))
        except ValueError as error:
            notes[source] = f"cannot be used: {error}"
    if start_timecode is not None:
        bases["config"] = _base_of_config(start_timecode, info)
    return _ranked(bases, notes, info)


def _ranked(bases: dict[str, TimeBase], notes: dict[str, str], info: VideoInfo) -> TimeSource:
    labels = {source: str(base.labels(0.0)) for source, base in bases.items()}
    unset = {source for source, label in labels.items() if label in ZERO and source not in ("ltc", "config")}
    order = sorted(
        (source for source in bases if not (source == "gop" and labels[source][:8] == ZERO[0][:8])),
        key=lambda source: source in unset,
    )
    chosen = order[0] if order else "none"
    base = bases.get(chosen, time_base(info.rate))
    table, problems = [], []
    for source in [*bases, *(source for source in notes if source not in bases)]:
        off = np.nan
        if source in bases and chosen in bases:
            off = float(bases[source].seconds(0.0) - base.seconds(0.0))
        note = notes.get(source, "")
        if source in unset:
            note = note or "counts from zero: it was never set"
        elif abs(off) > 1.5 / float(info.rate):
            problems.append(
                f"time code: {source} says {labels[source]} for the first frame, {chosen} says {labels[chosen]} "
                f"({off:+.3f} s); {chosen} is used"
            )
        table.append(SourceRow(source, labels.get(source, ""), off, source == chosen, note))
    problems += [f"time code: {source} {note}" for source, note in notes.items() if "cannot be used" in note]
    return TimeSource(replace(base, tick=info.time.tick), tuple(table), tuple(problems))


def _base_of_config(start_timecode: str, info: VideoInfo) -> TimeBase:
    try:
        return time_base(info.rate, parse(start_timecode, code_rate_of(info.stated_rate)), source="config")
    except ValueError as error:
        raise VidtrackError(f"start_timecode: {error}.") from None


def longitudinal(path: str, info: VideoInfo) -> Reading | None:
    """The longitudinal time code of the first sound channel that has any; None where none has."""
    for track in range(sound_tracks(path)):
        words, channel = _words_of_track(path, track, info.start)
        if channel is None:
            continue
        rate, drop = code_rate(words, 1.0, info.rate)
        reading = chained(words, words.start, words.period, rate, drop)
        if len(reading.time):
            return reading
    return None


def _words_of_track(path: str, track: int, start: Fraction) -> tuple[Words, int | None]:
    """The words of a track, start and period in s, and the channel that has them; None where it has none."""
    found: list[Words] = []
    channel: int | None = None
    tail, last = np.empty((0, 1), np.float32), -np.inf
    for n, block in enumerate(sound_blocks(path, track, start=start)):
        samples = np.concatenate([tail, block.samples]) if block.follows and len(tail) else block.samples
        time = block.time - (len(samples) - len(block.samples)) / block.rate
        if channel is None:
            tries = [read_words(column, block.rate) for column in samples.T]
            best = int(np.argmax([len(words.start) for words in tries]))
            words, channel = tries[best], best if len(tries[best].start) else None
        else:
            words = read_words(samples[:, channel], block.rate)
        if channel is None and n + 1 >= _PATIENCE:
            break
        words = words._replace(start=time + words.start / block.rate, period=words.period / block.rate)
        new = words.start > last + 0.5 * words.period
        if new.any():
            found.append(words.where(new))
            last = float(words.start[new][-1])
        tail = block.samples[-block.rate // 4 :]  # the word that the end of the block cuts off, at half speed too
    return joined(found), channel


def _base_of_reading(reading: Reading, rate: Fraction) -> TimeBase:
    """Anchors through the words: one a piece, more where the tape's speed wandered."""
    anchors: list[Anchor] = []
    for piece in np.unique(reading.piece):
        at = np.flatnonzero(reading.piece == piece)
        anchors += _anchors(reading.time[at], reading.frame[at], reading.rate, rate)
    anchors[0] = _moved(anchors[0], 0.0, reading.rate)
    return TimeBase(rate, reading.rate, reading.drop, tuple(anchors), source="ltc")


def _anchors(time: NDArray[np.float64], frame: NDArray[np.int64], code: Fraction, rate: Fraction) -> list[Anchor]:
    """Straight lines from time stamps to words that leave at most 0.02 frame, as few as halving makes."""
    n = frame - frame[0]
    middle = time.mean()
    slope = float(((time - middle) * n).sum() / max(((time - middle) ** 2).sum(), 1e-12)) if len(n) > 1 else float(code)
    speed = slope / float(code)
    if abs(speed - 1) * (time[-1] - time[0]) * float(code) < 0.05:
        speed = 1.0  # locked: what is left is noise, or a few millionths between two crystals
    rest = n - speed * float(code) * (time - time[0])
    if len(n) >= 24 and np.ptp(_quiet(rest)) > 0.04:
        half = len(n) // 2
        return _anchors(time[:half], frame[:half], code, rate) + _anchors(time[half:], frame[half:], code, rate)
    begin = round(float(time[0]) * float(rate)) / float(rate)  # anchors sit on frames
    position = float(np.median(rest)) + speed * float(code) * (begin - float(time[0]))
    return [_anchor(begin, int(frame[0]), position, speed)]


def _quiet(rest: NDArray[np.float64], width: int = 9) -> NDArray[np.float64]:
    return np.convolve(rest, np.ones(width) / width, mode="valid")


def _anchor(time: float, frame: int, position: float, speed: float) -> Anchor:
    whole = round(position)
    phase = position - whole
    return Anchor(time, frame + whole, phase if abs(phase) > 0.01 else 0.0, speed)


def _moved(anchor: Anchor, time: float, code: Fraction) -> Anchor:
    """The same line, held at another time."""
    position = anchor.phase + anchor.speed * float(code) * (time - anchor.time)
    return _anchor(time, anchor.frame, position, anchor.speed)


def _note_of(reading: Reading) -> str:
    parts = [f"{len(reading.time)} words at {float(reading.rate):.2f} a second{', drop-frame' * reading.drop}"]
    if abs(reading.speed - 1) > 0.002:
        parts.append(f"played at {reading.speed:.3f} of its speed")
    if reading.dropouts:
        longest = max(reading.dropouts, key=lambda gap: gap[2])
        missing = sum(gap[2] for gap in reading.dropouts)
        parts.append(
            f"{missing} words missing in {len(reading.dropouts)} dropouts, bridged "
            f"(the longest {longest[1] - longest[0]:.2f} s at {longest[0]:.2f} s)"
        )
    if reading.piece[-1]:
        parts.append(f"jumps {reading.piece[-1]} times")
    if reading.refused:
        parts.append(f"{reading.refused} words left out that follow from no other")
    return "; ".join(parts)


def _base_of_tape(path: str, info: VideoInfo) -> TimeBase | None:
    """From the code in every DV frame, read without decoding: an anchor at the first frame and wherever it jumps."""
    times, labels = _tape_codes(path, info)
    if not labels:
        return None
    drop = sum(";" in label for label in labels) > len(labels) / 2
    rate = exact_rate(info.rate)
    try:
        frames = frame_from_label(np.array(labels), rate, drop)
    except ValueError:
        return None  # a label that no frame has: a damaged or foreign code
    counted = np.rint(np.array(times) * float(rate)).astype(np.int64)
    off = frames - counted
    # a single odd label is damage; a jump is one that lasts
    begins = [0, *(i for i in range(1, len(off)) if off[i] != off[i - 1] and (off[i : i + 5] == off[i]).all())]
    begins = [i for k, i in enumerate(begins) if k == 0 or off[i] != off[begins[k - 1]]]
    anchors = tuple(Anchor(counted[i] / float(rate), int(frames[i])) for i in begins)
    first = Anchor(0.0, anchors[0].frame - int(counted[begins[0]]))
    return TimeBase(info.rate, rate, drop, (first, *anchors[1:]), source="dv")


def _tape_codes(path: str, info: VideoInfo) -> tuple[list[float], list[str]]:
    """Time stamps, s, and labels of the DV frames that have one: five bytes of each are read, where the index says."""
    with open_container(path) as container:
        stream = container.streams.video[0]
        if container.format.name == "dv":
            size = next(packet.size for packet in container.demux(stream))
            places = ((k * size, k / float(info.rate)) for k in range(container.size // size))
        else:
            scale, header = float(stream.time_base), 8 if container.format.name == "avi" else 0  # of an AVI chunk
            entries = stream.index_entries
            places = ((entry.pos + header, entry.timestamp * scale - float(info.start)) for entry in entries)
        times, labels = [], []
        with open(path, "rb") as file:
            for place, time in places:
                file.seek(place + 86)
                if label := code_of_dv(file.read(5)):
                    times.append(time)
                    labels.append(label)
    return times, labels


def _jumps(base: TimeBase) -> str:
    if len(base.anchors) == 1:
        return "a code in every frame, unbroken"
    at = ", ".join(
        f"to {label_from_frame(anchor.frame, base.code_rate, base.drop)!s} at {anchor.time:.2f} s"
        for anchor in base.anchors[1:4]
    )
    return f"a code in every frame; jumps {len(base.anchors) - 1} times ({at})"

"""At what rate a camera took its pictures, as its maker wrote it into the file, where it stores them at another.

Slow motion is often stored to be played at 30 pictures a second, time-lapse too: all times are then off by the ratio.
Android's cameras write `com.android.capture.fps` (the documented key of MediaMuxer), Sony's `captureFps` into the XML
that they put into an atom `meta` of the film. Other makers write nothing: see docs/filming.md.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import NamedTuple

from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.video.container import open_container
from vidtrack.video.times.atoms import atoms

ANDROID = "com.android.capture.fps"
SONY = re.compile(rb'captureFps="([0-9]{1,5}(?:\.[0-9]{1,4})?)[pi]?"')


@dataclass(frozen=True)
class Rates:
    """What is taken for a rate, and for slow motion without one.

    slowest, fastest  pictures a second
    apart       ratio to the stored rate from which on it is another one: phones that slow down in dim light stay below
    longer      times as long as their sound that pictures of slow motion last, within a share of the sound and block_s,
                as coders fill the last block of it; least_s: of sound, at least
    most_bytes  of an atom, that are looked at
    """

    slowest: float = 0.01
    fastest: float = 100_000.0
    apart: float = 1.4
    longer: tuple[float, ...] = (2.0, 4.0, 5.0, 8.0, 10.0)
    within: float = 0.02
    block_s: float = 0.07
    least_s: float = 1.0
    most_bytes: int = 1 << 20


RATES = Rates()


class MakersRate(NamedTuple):
    """Pictures a second at which they were taken, and who says so."""

    rate: float
    source: str


def makers_rate(path: str) -> MakersRate | None:
    """What a file says of the rate at which its pictures were taken; None where it says nothing that can be."""
    for rate, source in ((_android(path), ANDROID), (_sony(path), "Sony's captureFps")):
        if rate is not None and RATES.slowest <= rate <= RATES.fastest:
            return MakersRate(rate, source)
    return None


def rate_finding(path: str, stored: float, run: str) -> list[Finding]:
    """A recording that stores its pictures at another rate (1/s) than that at which they were taken."""
    found = makers_rate(path)
    if found is None:
        return _by_sound(path, stored, run)
    if not max(found.rate / stored, stored / found.rate) > RATES.apart:
        return []
    ratio = found.rate / stored
    wrong = f"{ratio:.3g} times too long, velocities too low" if ratio > 1 else f"{1 / ratio:.3g} times too short"
    text = (
        f"its pictures were taken at {found.rate:.4g} a second ({found.source} in the file) and are stored at "
        f"{stored:.4g}: all times are {wrong}"
    )
    cure = (
        f"Set runs.{run}.rate: {found.rate:.4g} (for one camera, cameras.<camera>.rate), or {stored:.4g} to confirm it."
    )
    return [Finding("bad", "taken-at-another-rate", text, cure)]


def _by_sound(path: str, stored: float, run: str) -> list[Finding]:
    """Pictures that last several times as long as their sound, which was not slowed down with them."""
    try:
        with open_container(path) as container:
            if not (container.streams.video and container.streams.audio):
                return []
            pictures, sound = (
                float(stream.duration * stream.time_base) if stream.duration and stream.time_base else 0.0
                for stream in (container.streams.video[0], container.streams.audio[0])
            )
    except (VidtrackError, ValueError):
        return []
    if sound < RATES.least_s:
        return []
    near = RATES.within * sound + RATES.block_s
    times = [own for own in RATES.longer if abs(pictures / own - sound) < near]
    if not times:
        return []
    text = (
        f"its pictures last {pictures:.3g} s and its sound {sound:.3g} s, {times[0]:g} times less: they may be slow "
        f"motion, taken at {stored * times[0]:.4g} a second and stored at {stored:.4g}"
    )
    cure = f"Set runs.{run}.rate: {stored * times[0]:.4g} where that is so, or {stored:.4g} to confirm it."
    return [Finding("doubtful", "taken-at-another-rate", text, cure)]


def _android(path: str) -> float | None:
    try:
        with open_container(path) as container:
            return float(container.metadata.get(ANDROID, "nan"))
    except (VidtrackError, ValueError):
        return None


def _sony(path: str) -> float | None:
    try:
        with open(path, "rb") as file:
            if file.read(8)[4:] not in (b"ftyp", b"mdat", b"moov", b"wide", b"free"):
                return None
            for kind, (begin, end) in atoms(file, (0, os.fstat(file.fileno()).st_size)):
                if kind in (b"meta", b"uuid"):
                    file.seek(begin)
                    said = SONY.search(file.read(min(end - begin, RATES.most_bytes)))
                    if said:
                        return float(said[1])
    except (OSError, OverflowError, ValueError):
        pass
    return None

"""What the user should know of how targets were tracked: which were not measured and why, and what else there is."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from vidtrack.arrays import Array, Bools, Picture
from vidtrack.findings import Finding, Level
from vidtrack.timing.frame import ReadAccount
from vidtrack.tracking.centroiding.background import SURROUNDINGS
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.detection.background_picture import bright_mask
from vidtrack.tracking.detection.blobs import above
from vidtrack.tracking.detection.threshold import background_level
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import CORRUPT, EDGE, LOST, MERGED, REPEATED, SMALL, Rows, present
from vidtrack.tracking.uncertainty.empirical_sd import Scatter


@dataclass(frozen=True)
class Limits:
    """Shares of the samples: below `bad` a target measured is hardly tracked, below `half` seldom, below `whole` not
    all the time, which the positions in space judge: other cameras may have seen it; a larger share of samples than
    `repeated` that show the picture before is no accident.
    """

    bad: float = 0.1
    half: float = 0.5
    whole: float = 0.9
    repeated: float = 0.02


LIMITS = Limits()
_WHY = (
    (REPEATED, "the picture repeats the one before"),
    (CORRUPT, "the picture is damaged"),
    (MERGED, "it touches something else that is as bright"),
    (EDGE, "it is cut by the edge of the picture"),
    (SMALL, "it has fewer pixels than detect.min_pixels"),
    (LOST, "it is not seen where it should be"),
)


class InBox(NamedTuple):
    """What a start box shows in the first sample.

    contrast  grey levels, of its brightest pixels over what is usual in it, or in the picture where that is darker
    peak      grey level, as stored: the largest in the box, or the smallest for dark targets
    cut       something bright goes on beyond the box; size (2,) px, width and height of the whole of it
    outside   what stands out nearest to the box is so far from its middle, px; NaN: nothing does
    """

    contrast: float
    peak: float
    cut: bool
    size: tuple[int, int]
    outside: float


def in_boxes(sample: Sample, boxes: Array, detection: Detection) -> list[InBox]:
    """What start boxes (n, 4), middle, width and height px, show."""
    image = detection.bright(sample.luma)
    mask = bright_mask(image, detection)
    _, _, stats, middle = cv2.connectedComponentsWithStats(mask, connectivity=8)
    rows, columns = image.shape
    usual = background_level(image, scale=detection.scale)
    findings = []
    for x, y, width, height in boxes:
        row, high = float(sample.row(np.array([y]))[0]), height / sample.lines
        left, right = (int(np.clip(round(v), 0, columns - 1)) for v in (x - width / 2, x + width / 2))
        top, bottom = (int(np.clip(round(v), 0, rows - 1)) for v in (row - high / 2, row + high / 2))
        piece = image[top : bottom + 1, left : right + 1]
        light = np.sort(piece, axis=None).astype(float) * detection.scale
        few = light[-max(detection.min_pixels, 1) :]
        whole = stats[:, cv2.CC_STAT_AREA] >= detection.min_pixels
        whole[0] = False
        off = np.hypot(middle[whole, 0] - x, (middle[whole, 1] - row) * sample.lines)
        peak = float(few.mean())
        share, size = _whole_of(image, (left, top, right, bottom), (usual + peak) / 2 / detection.scale)
        findings.append(
            InBox(
                peak - min(float(np.median(light)), usual),
                255.0 - peak if detection.dark else peak,
                share < 0.9,
                (size[0], size[1] * sample.lines),
                float(off.min()) if off.size else np.nan,
            )
        )
    return findings


def _whole_of(image: Picture, box: tuple[int, int, int, int], level: float) -> tuple[float, tuple[int, int]]:
    """Share of what is brightest in a box (left, top, right, bottom px) that lies in it, and width and height of all of
    that, as far as three times the box; 1 and 0 where nothing is above the level (stored values).
    """
    left, top, right, bottom = box
    wide, high = right - left + 1, bottom - top + 1
    x, y = max(0, left - wide), max(0, top - high)
    about = image[y : bottom + high + 1, x : right + wide + 1]
    _, labels, stats, _ = cv2.connectedComponentsWithStats(above(about, level), connectivity=8)
    counts = np.bincount(labels[top - y : bottom - y + 1, left - x : right - x + 1].ravel(), minlength=len(stats))
    counts[0] = 0
    most = int(np.argmax(counts))
    if not counts[most]:
        return 1.0, (0, 0)
    return float(counts[most] / stats[most, cv2.CC_STAT_AREA]), (int(stats[most, 2]), int(stats[most, 3]))


def missing_targets(
    rows: Rows, names: Sequence[str], expected: Sequence[InBox] | None, detection: Detection
) -> list[Finding]:
    """Targets that were measured in few samples or in none, with the likeliest cause."""
    if not len(rows.flag):
        return []
    seen = present(rows)
    share = seen.mean(axis=0)
    findings = []
    if expected is None and (never := [name for name, some in zip(names, share, strict=True) if not some]):
        text = f"never found: {', '.join(never)}: {len(names) - len(never)} of {len(names)} targets are to be seen."
        cure = "Set targets to how many there are, give a start box in targets.csv, or a threshold."
        if len(never) == len(names):
            other = "bright" if detection.dark else "dark"
            cure += f" Where targets are {other}er than what is about them: detect.polarity: {other}."
        findings.append(Finding("bad", "target-never-measured", text, cure))
    for i, name in enumerate(names):
        if expected is not None and not share[i]:
            cause, cure = _cause(expected[i], rows, i, detection)
            text = f"{name}: not measured in any sample: {cause}."
            findings.append(Finding("bad", "target-never-measured", text, cure))
        elif share[i]:
            findings += _partly(rows, name, i, seen[:, i])
    return findings


def _partly(rows: Rows, name: str, i: int, seen: Bools) -> list[Finding]:
    """Whether a target was seen in few of the samples (k,) between its first and its last, or these are few."""
    first, last = int(np.argmax(seen)), len(seen) - 1 - int(np.argmax(seen[::-1]))
    share, whole = float(seen[first : last + 1].mean()), (last + 1 - first) / len(seen)
    findings = []
    if share < LIMITS.whole:
        level: Level = "bad" if share < LIMITS.bad else "doubtful" if share < LIMITS.half else "note"
        flags = rows.flag[first : last + 1, i][~seen[first : last + 1]]
        why = max(_WHY, key=lambda one: int((flags & one[0] > 0).sum()))[1]
        text = (
            f"{name}: measured in {share:.0%} of the samples from its first to its last; in most of the others {why}."
        )
        findings.append(Finding(level, "target-rarely-measured", text, "Look at the crops of the worst moments."))
    if whole < LIMITS.whole:
        level = "note" if whole > LIMITS.bad else "doubtful"
        text = f"{name}: seen in samples {first} to {last} of {len(seen)} only."
        findings.append(
            Finding(level, "target-part-of-run", text, "Nothing, if it came or left then; else its start box.")
        )
    return findings


def _cause(box: InBox, rows: Rows, i: int, detection: Detection) -> tuple[str, str]:
    """Why a target with a start box was never measured, most likely, and what to do."""
    level = detection.threshold
    side = "above" if detection.dark else "below"
    if box.contrast < SURROUNDINGS.stands_out * detection.noise:
        elsewhere = "" if np.isnan(box.outside) else f"; the nearest bright thing is {box.outside:.0f} px away"
        what = f"nothing in its start box stands out of the noise of {detection.noise:.1f} grey levels{elsewhere}"
        return what, "Correct its start box in targets.csv, as the picture lies in the file, or detect.polarity."
    if level is not None and (box.peak > level if detection.dark else box.peak < level):
        return (
            f"the threshold of {level:g} is not reached: its box is {side} it, {box.peak:.0f} at most",
            "Set detect.threshold to auto, or half-way between the target and its background.",
        )
    if box.cut:
        width, height = box.size
        return (
            f"what stands out in its start box goes on beyond it, {width} x {height} px in all",
            f"Set detect.box to at least [{width + 20}, {height + 20}], or give width and height in targets.csv.",
        )
    why = max(_WHY, key=lambda one: int((rows.flag[:, i] & one[0] > 0).sum()))[1]
    return why, "Look at the crops of the worst moments; move its start box, or set detect.threshold."


def scattering(seen: Scatter, names: Sequence[str]) -> list[Finding]:
    """Tracks that scatter more than noise, contrast and light explain."""
    return [
        Finding(
            "doubtful",
            "track-scatters",
            f"{name}: its track scatters {np.nanmax(seen.track[:, i]):.0f} times as much as noise and contrast "
            f"explain, its light {max(seen.light[i], 1.0):.1f} times: it shakes, is blurred, or pictures repeat. "
            "Its sd_x, sd_y are grown by the latter only.",
            "Switch the camera's stabiliser off, and take the recording as the camera wrote it: a conversion to "
            "another rate leaves pictures out or repeats them.",
        )
        for i, name in enumerate(names)
        if seen.rough[i]
    ]


def repeated_pictures(flags: Sequence[bool], rows: Rows) -> list[Finding]:
    """How many pictures repeat the one before, flags (frames,), where that has cost samples of moving targets."""
    lost = (rows.flag & REPEATED > 0).any(axis=1).mean() if len(rows.flag) else 0.0
    if not lost:
        return []
    level: Level = "note" if lost < LIMITS.repeated else "doubtful"
    text = (
        f"{sum(flags)} of {len(flags)} pictures repeat the one before, bit by bit: moving targets are flagged repeated "
        "there and not measured."
    )
    return [Finding(level, "pictures-repeat", text, "Copy the recording again, without a change of frame rate.")]


def damaged_pictures(indices: Collection[int]) -> list[Finding]:
    """Pictures whose damage the decoder did not report, by the frames' numbers."""
    if not indices:
        return []
    at = sorted(indices)
    begins = [k for k in at if k - 1 not in indices]
    ends = [k for k in at if k + 1 not in indices]
    places = [str(a) if a == b else f"{a} to {b}" for a, b in zip(begins, ends, strict=True)]
    more = f" and {len(places) - 3} places more" if len(places) > 3 else ""
    text = (
        f"{len(at)} pictures are damaged, though their decoder reports nothing (frame {', '.join(places[:3])}{more}): "
        "the still background changes in many blocks at once and comes back as suddenly, or pictures are full before "
        "their data end. Nothing is measured there."
    )
    return [Finding("doubtful", "damage-seen", text, "Copy the recording again from the camera or tape.")]


def line(finding: Finding) -> str:
    """A finding as one line."""
    return f"{finding.text} {finding.cure}".strip()


READ_CURE = "Look at the recording there, and copy it again from the camera or tape; what was read has its own time."


def reading_findings(account: ReadAccount, time_problems: Sequence[str]) -> list[Finding]:
    """What was seen while a recording was read, and of the sources of its time; lost pictures are the verdict's.

    All times depend on a rate that was assumed.
    """
    found = []
    for text in account.problems:
        assumed = text.endswith("give rate")
        cure = "Set rate of the run to the pictures that the camera took a second." if assumed else READ_CURE
        found.append(Finding("doubtful", "rate-assumed" if assumed else "reading", text, cure))
    return [*found, *(Finding("doubtful", "time-source", text, "") for text in time_problems)]

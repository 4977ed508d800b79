"""The courses of groups: where they are in space at the moments at which two of their cameras see them; of one camera
alone, where they are in its picture.

Also of pairs of groups as if they were one target, and what the motion says of that at the seams: the places where
the joint course passes from what one of them shows to what the other one, or only both together, show.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.association.continuity import FLOOR, LENGTHS, Evidence, Motion
from vidtrack.association.distinct import distinct_pairs
from vidtrack.association.tracklets import LONGEST_GAP, Tracklets
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.triangulate import places_of

AROUND = LENGTHS[-1]
"""Moments on either side of the shorter group that a joint course is made for."""
TOGETHER = 32_768
"""Rows from which joint courses are made together, about."""
SEAMS = 4
"""Seams of a joint course that are judged, at most: the longest."""


class Rows(NamedTuple):
    """All rows of all cameras' tracklets, by node, and those of one by moment."""

    camera: Ints  # (N,)
    moment: Ints  # (N,)
    node: Ints  # (N,)
    b: Array  # (N, 2) px
    sd: Array  # (N, 2) px, the calibration's share included


class Course(NamedTuple):
    """Places (k, d) at moments (k,), rising; `source` is which of two groups each rests on: 1, 2, or 3 for both."""

    moment: Ints
    place: Array
    source: Ints


def rows_of(tracklets: Sequence[Tracklets], begin: Ints, bias_px: float) -> Rows:
    """All rows, by node; begin (n_cameras + 1,) as of `groups.nodes_of`."""
    camera = np.repeat(np.arange(len(tracklets)), [len(t.sample) for t in tracklets])
    moment = np.concatenate([t.sample for t in tracklets])
    node = np.concatenate([t.owner + begin[i] for i, t in enumerate(tracklets)])
    sd = np.sqrt(np.concatenate([t.sd for t in tracklets]) ** 2 + bias_px**2)
    return Rows(camera, moment, node, np.concatenate([t.b for t in tracklets]), sd)


def fewest_of(cameras: Sequence[Camera | None]) -> int:
    """Cameras that must see a target for it to have a place: two in space, one where there is no other."""
    return min(2, len(cameras))


def courses(cameras: Sequence[Camera | None], rows: Rows, chosen: Sequence[tuple[Ints, Ints]]) -> list[Course]:
    """The joint course of each choice: rows, and for each row 1 or 2, the part that it belongs to."""
    if not chosen:
        return []
    parts = [_seen(cameras, rows, chosen[i:j], i) for i, j in _batches([len(r) for r, _ in chosen])]
    own, moment, source = (np.concatenate(column) for column in zip(*(part[:3] for part in parts), strict=True))
    b, sd = (np.concatenate(column, axis=1) for column in zip(*(part[3:] for part in parts), strict=True))
    del parts
    if fewest_of(cameras) > 1:
        point = places_of([camera for camera in cameras if camera is not None], b, sd, most_unsure=np.inf)
    else:
        point = b[0]
    good = np.flatnonzero(np.isfinite(point[:, 0]))
    moment, point, source = moment[good], point[good], source[good]
    edges = np.searchsorted(own[good], np.arange(len(chosen) + 1))
    return [Course(moment[i:j], point[i:j], source[i:j]) for i, j in itertools.pairwise(edges)]


def _batches(lengths: Sequence[int]) -> list[tuple[int, int]]:
    """First and last + 1 of neighbours that are taken together: so few rows that they stay in the caches."""
    edges, n = [0], 0
    for k, length in enumerate(lengths):
        n += length
        if n >= TOGETHER or k == len(lengths) - 1:
            edges.append(k + 1)
            n = 0
    return list(itertools.pairwise(edges))


def _seen(
    cameras: Sequence[Camera | None], rows: Rows, chosen: Sequence[tuple[Ints, Ints]], first: int
) -> tuple[Ints, Ints, Ints, Array, Array]:
    """Number of the choice (k,), moment (k,) and source (k,) wherever enough cameras see it, positions and their sd
    (n_cameras, k, 2); the choices are numbered from `first`.
    """
    of = np.repeat(np.arange(len(chosen)), [len(r) for r, _ in chosen])
    row = np.concatenate([r for r, _ in chosen]).astype(np.intp)
    part = np.concatenate([p for _, p in chosen])
    own, moment, place, _ = distinct_pairs(of, rows.moment[row])
    b = np.full((len(cameras), len(own), 2), np.nan)
    sd = np.ones(b.shape)
    at = rows.camera.take(row) * len(own) + place
    b.reshape(-1, 2)[at] = rows.b.take(row, axis=0)
    sd.reshape(-1, 2)[at] = rows.sd.take(row, axis=0)
    one, other = (np.bincount(place[part == k], minlength=len(own)) for k in (1, 2))
    fewest = fewest_of(cameras)
    fixed = np.flatnonzero(np.isfinite(b[..., 0]).sum(0) >= fewest)
    source = np.where(one[fixed] >= fewest, 1, np.where(other[fixed] >= fewest, 2, 3))
    if fixed.size < len(own):
        b, sd = b[:, fixed], sd[:, fixed]
    return own[fixed] + first, moment[fixed], source, b, sd


def filled(course: Course) -> Course:
    """The same with straight lines over gaps of at most LONGEST_GAP moments between places of one source."""
    gap = np.diff(course.moment)
    short = np.flatnonzero((gap > 1) & (gap <= LONGEST_GAP + 1) & (np.diff(course.source) == 0))
    if not short.size:
        return course
    missing = gap[short] - 1
    at = np.repeat(short, missing)
    later = 1 + np.arange(at.size) - np.repeat(np.cumsum(missing) - missing, missing)
    share = (later / gap[at])[:, None]
    between = course.place[at] * (1 - share) + course.place[at + 1] * share
    return Course(
        np.insert(course.moment, at + 1, course.moment[at] + later),
        np.insert(course.place, at + 1, between, axis=0),
        np.insert(course.source, at + 1, course.source[at]),
    )


def stretches(course: Course) -> list[tuple[int, int]]:
    """First and last index + 1 of each stretch of consecutive moments of one source."""
    cut = np.flatnonzero((np.diff(course.moment) != 1) | (np.diff(course.source) != 0)) + 1
    edges = [0, *cut.tolist(), len(course.moment)]
    return [(i, j) for i, j in itertools.pairwise(edges) if j > i]


def end_to_end(some: Sequence[Course]) -> Course:
    """Several courses one after the other, each of sources of its own."""
    own = np.repeat(np.arange(len(some)), [len(c.moment) for c in some])
    moment, place, source = (np.concatenate(column) for column in zip(*some, strict=True))
    return Course(moment, place, 4 * own + source)


def motion_of(course: Course) -> Motion:
    """How the targets of a run move, from their courses end to end."""
    whole = filled(course)
    pieces = [whole.place[i:j] for i, j in stretches(whole)]
    return Motion(pieces or [course.place])


def longest_gap(moment: Ints, source: Ints) -> int:
    """Moments of the longest gap at which one source of a course passes into another one; 0 where none does."""
    step = np.diff(moment)[np.diff(source) != 0]
    return int(step.max(initial=0))


def seam_evidence(course: Course, motion: Motion) -> Evidence:
    """What the motion says of a joint course, over the longest of its seams; it refutes no more than one jump may.

    What lies in a gap of the other one has two seams, and a target may bounce at both.
    """
    course = filled(course)
    parts = stretches(course)
    seams = []
    for (i, j), (k, m) in itertools.pairwise(parts):
        if course.source[j - 1] != course.source[k]:
            gap = int(course.moment[k] - course.moment[j - 1])
            seams.append((min(j - i, m - k), course.place[i:j][-AROUND:], course.place[k:m][:AROUND], gap))
    seams.sort(key=lambda s: -s[0])
    seen = [motion.evidence(before, after, gap) for _, before, after, gap in seams[:SEAMS]]
    return Evidence(max(sum(e.nats for e in seen), FLOOR), float(sum(e.information for e in seen)))

"""Association: which tracklets of all cameras show which target, over the whole run at once.

1. Pairs of tracklets of different cameras are weighed by their lines of sight (`pairs`).
2. Tracklets are joined to groups as far as lines of sight tell beyond doubt (`groups`).
3. How targets move is measured on these groups' courses, and the rest is joined by sights and motion (`bridging`).
4. Groups that two cameras see become trajectories; tracklets that remain are of none, each with its reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.association.bridging import Bridges
from vidtrack.association.courses import Course, rows_of
from vidtrack.association.groups import MARGIN, Groups, nodes_of
from vidtrack.association.pairs import Pairs, Rays, bias_of, pairs_of, rays_of
from vidtrack.association.tracklets import Tracklets
from vidtrack.geometry.camera import Camera

NONE = -1
"""No trajectory."""

LEAST_BIAS_PX = 0.02
"""# ASSUME: px, what a calibration leaves at least."""
SOME = 200
"""Moments, evenly spread, that tell what the calibration leaves."""
LASTING = 40.0
"""Nats, at most, for one target rather than one that vanishes and another that appears, where their number is known."""
APART_PX = 20.0
"""# ASSUME: px of motion after which lines of sight that met by chance meet no more."""
FEWEST = 5
"""Moments with a fix that a trajectory has, at least, or all there are."""


class Association(NamedTuple):
    """What `associate` returns; m trajectories, those of the first camera's first tracklets first."""

    trajectory: tuple[Ints, ...]  # for each camera (n_tracklets,): the trajectory of each; NONE
    reason: tuple[NDArray[np.object_], ...]  # for each camera (n_tracklets,): why it is of none; '' where it is of one
    lead: Array  # (m,) nats by which the least sure of a trajectory's joins is likelier than any other choice
    bias_px: float  # what the calibration was found to leave

    @property
    def m(self) -> int:
        """How many trajectories there are."""
        return len(self.lead)


def associate(
    cameras: Sequence[Camera],
    tracklets: Sequence[Tracklets],
    *,
    targets: int | None = None,
    tolerance_px: float = 3.0,
) -> Association:
    """Join tracklets of several cameras to trajectories in space.

    tracklets      for each camera; their samples are indices of moments that all cameras share
    targets        how many trajectories there are, at most; None: not known
    tolerance_px   what the calibration may leave, px, at most: 3 standard deviations
    A tracklet of fewer cameras than two at any moment is of no trajectory unless the motion joins it to one.
    """
    rays = [rays_of(c, t.b) for c, t in zip(cameras, tracklets, strict=True)]
    moments = np.unique(np.concatenate([t.sample for t in tracklets]))
    most = tolerance_px / 3
    some = moments[:: max(1, moments.size // SOME)]
    bias = bias_of(list(_pairs(cameras, tracklets, rays, most, some).values()), LEAST_BIAS_PX, most)
    groups = Groups(nodes_of(tracklets), len(cameras))
    for (i, j), pairs in _pairs(cameras, tracklets, rays, bias, moments).items():
        groups.add(i, j, pairs)
    groups.join_the_clear()
    bridges = Bridges(cameras, rows_of(tracklets, groups.nodes.begin, bias), groups)
    bridges.learn()
    bridges.join_the_clear()
    if targets is not None:
        bridges.join_to(targets, LASTING)
    courses = bridges.group_courses()
    if targets is None:
        courses = {g: c for g, c in courses.items() if _beyond_chance(bridges, g)}
    chosen = _chosen(courses, targets)
    return _told(groups, tracklets, chosen, bias)


def _pairs(
    cameras: Sequence[Camera], tracklets: Sequence[Tracklets], rays: Sequence[Rays], bias_px: float, moments: Ints
) -> dict[tuple[int, int], Pairs]:
    return {
        (i, j): pairs_of((cameras[i], cameras[j]), (tracklets[i], tracklets[j]), (rays[i], rays[j]), bias_px, moments)
        for i, j in combinations(range(len(cameras)), 2)
    }


def _beyond_chance(bridges: Bridges, g: int) -> bool:
    """Whether lines of sight that meet are more than a coincidence among all tracklets.

    Two things that stand in two pictures meet by chance as often as one of them lies within the noise of the other's
    epipolar line; things that move would have to go on meeting. One that stands and is seen by two cameras alone may
    well be none where much stands about.
    """
    rows, groups = bridges.rows, bridges.groups
    own = bridges.rows_of_nodes(groups.members[g])
    cameras = [i for i, spans in enumerate(groups.spans[g]) if spans]
    extent = max(float(np.ptp(rows.b[own[rows.camera[own] == i]], axis=0).max()) for i in cameras)
    chance = 5 * float(np.median(rows.sd[own])) / max(bridges.cameras[cameras[0]].image_size)
    looks = (1 + extent / APART_PX) * (2 * len(cameras) - 3)
    first, last = groups.span[g]
    nodes = groups.nodes
    begin = nodes.begin
    tries = 0.0
    for i in cameras:
        several = slice(int(begin[i]), int(begin[i + 1]))
        there = (np.array(nodes.first[several]) <= last) & (np.array(nodes.last[several]) >= first)
        tries += float(np.log(max(int(there.sum()), 1)))
    return bool(-looks * np.log(min(chance, 0.5)) - tries > MARGIN)


def _chosen(courses: dict[int, Course], targets: int | None) -> list[int]:
    """Groups that are trajectories: those with most fixes; of few targets, those that move before those that stand."""
    longest = max((len(c.moment) for c in courses.values()), default=0)
    found = [g for g, c in courses.items() if len(c.moment) >= min(FEWEST, longest) and len(c.moment)]
    if targets is None or len(found) <= targets:
        return found
    size = {g: len(courses[g].moment) * (1.0 if _moves(courses[g]) else 0.1) for g in found}
    return sorted(found, key=lambda g: -size[g])[:targets]


def _moves(course: Course) -> bool:
    """Whether a course goes anywhere: its places spread more than their changes from moment to moment explain."""
    p = course.place
    if len(p) < 8:
        return True
    jitter = np.median(np.linalg.norm(np.diff(p, axis=0), axis=-1))
    return bool(np.linalg.norm(p.std(axis=0)) > 2 * jitter)


def _told(groups: Groups, tracklets: Sequence[Tracklets], chosen: Sequence[int], bias: float) -> Association:
    order = sorted(chosen, key=lambda g: min(groups.members[g]))
    number = {g: k for k, g in enumerate(order)}
    begin = groups.nodes.begin
    trajectory, reason = [], []
    for i in range(len(tracklets)):
        roots = groups.root[int(begin[i]) : int(begin[i + 1])]
        trajectory.append(np.array([number.get(g, NONE) for g in roots], np.intp))
        reason.append(np.array(["" if g in number else _why(groups, g) for g in roots], object))
    return Association(tuple(trajectory), tuple(reason), np.array([groups.lead[g] for g in order]), bias)


def _why(groups: Groups, g: int) -> str:
    """Why a group is no trajectory."""
    if groups.cameras(g) > 1:
        return "surplus"  # fewer fixes than the trajectories chosen, or too few to be believed
    if any(groups.value(g, h) > 0 for h in groups.neighbours(g)):
        return "contested"  # fits another camera's, but so do others
    return "alone"  # no other camera shows it

"""Association: which tracklets of all cameras show which target, over the whole run at once.

1. Pairs of tracklets of different cameras are weighed by their lines of sight (`pairs`).
2. Tracklets are joined to groups as far as lines of sight decide it beyond doubt (`groups`).
3. How targets move is measured on these groups' courses, and the rest is joined by sights and motion (`bridging`).
4. Groups that two cameras see become trajectories; tracklets that remain belong to none, each with its reason. Mirror
   images are none either, and a stretch that may be a part of several trajectories stays a trajectory of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array, Ints
from vidtrack.association.bridging import LASTS, Bridges
from vidtrack.association.courses import Course, rows_of
from vidtrack.association.groups import MARGIN, Groups, nodes_of
from vidtrack.association.mirror import images_among
from vidtrack.association.pairs import Pairs, Rays, Side, bias_of, by_moment, pairs_of, rays_of
from vidtrack.association.rigid_bodies import Body, members_of
from vidtrack.association.tracklets import Tracklets
from vidtrack.geometry.camera import Camera
from vidtrack.memory import collector_paused

NONE = -1
"""No trajectory."""

LEAST_BIAS_PX = 0.02
"""# ASSUME: px, what a calibration leaves at least."""
SOME = 200
"""Moments, evenly spread, from which what the calibration leaves is estimated."""
LASTING = 40.0
"""Nats, at most, for one target rather than one that vanishes and another that appears, where their number is known."""
APART_PX = 20.0
"""# ASSUME: px of motion after which lines of sight that met by chance meet no more."""
FEWEST = 5
"""Moments with a fix that a trajectory has, at least, or all there are."""


class Left(NamedTuple):
    """What was located and belongs to none of the targets asked for."""

    reason: str  # surplus: those chosen go on for longer, or it is too short; mirror: the image of a target
    of: int  # the trajectory that it is the image of; NONE
    first: int  # first and last moment
    last: int
    n: int  # moments with a fix
    place: Array  # (d,) mean


class Ties(NamedTuple):
    """What holds each of a camera's n tracklets to its trajectory, at its least sure join."""

    lead: Array  # (n,) nats by which the join is likelier than any other choice; NaN where it was joined with nothing
    fellow: Ints  # (n, 2) camera and tracklet that it was joined with; NONE
    rival: Ints  # (n, 2) camera and tracklet of the next best choice; NONE


class Association(NamedTuple):
    """What `associate` returns; m trajectories, those of the first camera's first tracklets first."""

    trajectory: tuple[Ints, ...]  # for each camera (n_tracklets,): the trajectory of each; NONE
    reason: tuple[NDArray[np.object_], ...]  # for each camera (n_tracklets,): why it is unused; '' where it is used
    ties: tuple[Ties, ...]  # for each camera
    names: tuple[str, ...]  # (m,) that a start box or a rigid body gives each trajectory; '' where none does
    lead: Array  # (m,) nats by which the least sure of a trajectory's joins is likelier than any other choice
    part_of: tuple[tuple[int, ...], ...]  # (m,) of which trajectories each may be a part; empty: of no other
    left: tuple[Left, ...]  # the longest first
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
    names: Sequence[Sequence[str]] | None = None,
    bodies: Sequence[Body] = (),
    uneven: Sequence[Array] | None = None,
) -> Association:
    """Join tracklets of several cameras to trajectories in space.

    tracklets      for each camera; their samples are indices of moments that all cameras share
    targets        how many trajectories there are, at most; None: not known
    tolerance_px   what the calibration may leave, px, at most: 3 standard deviations
    names          for each camera the name of each tracklet that begins in a start box, else ''; None: no box is known
    bodies         rigid bodies: their targets with their places in the body, world units
    uneven         for each camera (N, 2): by how much worse than usual its calibration is in X and Y at each row of its
                   tracklets, at least 1; None: it is as good everywhere
    A tracklet that no second camera shows at any moment belongs to no trajectory unless the motion joins it to one.
    A stretch that may continue several targets, where nothing shows which, is a trajectory by itself (`part_of`).
    """
    with collector_paused():
        return _associated(cameras, tracklets, targets, tolerance_px, names, bodies, uneven)


def _associated(
    cameras: Sequence[Camera],
    tracklets: Sequence[Tracklets],
    targets: int | None,
    tolerance_px: float,
    names: Sequence[Sequence[str]] | None,
    bodies: Sequence[Body],
    uneven: Sequence[Array] | None,
) -> Association:
    rays = rays_of(cameras, [t.b for t in tracklets])
    moments = np.unique(np.concatenate([t.sample for t in tracklets]))
    most = tolerance_px / 3
    some = moments[:: max(1, moments.size // SOME)]
    bias = bias_of(list(_pairs(cameras, tracklets, rays, most, some).values()), LEAST_BIAS_PX, most)
    if uneven is not None:
        tracklets = [
            t._replace(sd=np.sqrt(t.sd**2 + bias**2 * (by**2 - 1))) for t, by in zip(tracklets, uneven, strict=True)
        ]
    groups = Groups(nodes_of(tracklets, names), len(cameras))
    for (i, j), pairs in _pairs(cameras, tracklets, rays, bias, moments).items():
        groups.add(i, j, pairs)
    groups.join_the_clear()
    bridges = Bridges(cameras, rows_of(tracklets, groups.nodes.begin, bias), groups)
    courses = _bridged(bridges, targets, bodies)
    if targets is None:
        courses = {g: c for g, c in courses.items() if _beyond_chance(bridges, g)}
    images = _images(courses, np.array([c.position for c in cameras]))
    chosen = _chosen({g: c for g, c in courses.items() if g not in images}, targets, groups)
    return _outcome(groups, tracklets, chosen, courses, images, targets, bias)


def associate_in_picture(
    tracklets: Tracklets, *, targets: int | None = None, names: Sequence[str] | None = None
) -> Association:
    """Join one camera's tracklets to trajectories in its picture, by their motion alone; as `associate`."""
    groups = Groups(nodes_of([tracklets], None if names is None else [names]), 1)
    bridges = Bridges([None], rows_of([tracklets], groups.nodes.begin, 0.0), groups)
    courses = _bridged(bridges, targets)
    return _outcome(groups, [tracklets], _chosen(courses, targets, groups), courses, {}, targets, 0.0)


def _bridged(bridges: Bridges, targets: int | None, bodies: Sequence[Body] = ()) -> dict[int, Course]:
    """The courses of groups when all that is clear is joined."""
    bridges.learn()
    bridges.join_the_clear()
    if bodies:
        bridges.groups.give(members_of(bridges.group_courses(), bodies))
        bridges.join_the_clear()
    if targets is not None:
        bridges.join_to(targets, LASTING)
    return bridges.group_courses()


def _pairs(
    cameras: Sequence[Camera], tracklets: Sequence[Tracklets], rays: Sequence[Rays], bias_px: float, moments: Ints
) -> dict[tuple[int, int], Pairs]:
    sides = [
        Side(camera, t, r, by_moment(t, r, bias_px, moments))
        for camera, t, r in zip(cameras, tracklets, rays, strict=True)
    ]
    return {(i, j): pairs_of(sides[i], sides[j], bias_px, moments) for i, j in combinations(range(len(cameras)), 2)}


def _beyond_chance(bridges: Bridges, g: int) -> bool:
    """Whether lines of sight that meet are more than a coincidence among all tracklets.

    The lines of sight to two things at rest meet by chance whenever one of them lies within the noise of the other's
    epipolar line; those to things that move would have to meet again and again. Where there is much static clutter, a
    group at rest that only two cameras see may be such a coincidence.
    """
    rows, groups = bridges.rows, bridges.groups
    own = bridges.rows_of_nodes(groups.members[g])
    cameras = [i for i, spans in enumerate(groups.spans[g]) if spans]
    extent = max(float(np.ptp(rows.b[own[rows.camera[own] == i]], axis=0).max()) for i in cameras)
    camera = bridges.cameras[cameras[0]]
    assert camera is not None
    chance = 5 * float(np.median(rows.sd[own])) / max(camera.image_size)
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


def _images(courses: dict[int, Course], eyes: Array) -> dict[int, int]:
    """Groups that are mirror images of others, each with that which it is the image of."""
    several = list(courses)
    found = images_among([courses[g].moment for g in several], [courses[g].place for g in several], eyes)
    return {several[i]: several[j] for i, j in found.items()}


def _chosen(courses: dict[int, Course], targets: int | None, groups: Groups) -> list[int]:
    """Groups that are trajectories: those with most fixes; of few targets, those that start boxes name before others,
    and those that move before those at rest.

    Those that are seen at one and the same moment come first: they are certainly different targets.
    """
    longest = max((len(c.moment) for c in courses.values()), default=0)
    found = [g for g, c in courses.items() if len(c.moment) >= min(FEWEST, longest) and len(c.moment)]
    if targets is None or len(found) <= targets:
        return found
    size = {g: len(courses[g].moment) * (1.0 if _moves(courses[g]) else 0.1) for g in found}
    best = sorted(found, key=lambda g: (not groups.names[g], -size[g]))
    at_once: list[int] = []
    for moment in {groups.span[g][0] for g in found}:
        there = [g for g in best if groups.span[g][0] <= moment <= groups.span[g][1]][:targets]
        if _merit(there, groups, size) > _merit(at_once, groups, size):
            at_once = there
    return [*at_once, *(g for g in best if g not in at_once)][:targets]


def _merit(several: Sequence[int], groups: Groups, size: dict[int, float]) -> tuple[int, float]:
    return sum(bool(groups.names[g]) for g in several), sum(size[g] for g in several)


def _alternatives(
    groups: Groups, courses: dict[int, Course], chosen: Sequence[int], images: dict[int, int]
) -> dict[int, tuple[int, ...]]:
    """Courses that are parts of chosen ones, though it is not known of which: each with those that are possible.

    At no moment may more courses be located than there are targets, so that each of them is a target; and the motion
    must allow each to be continued by one of the chosen, or to continue it. What one camera alone shows of a course
    may be the blob of several targets, and is not counted.
    """
    out: dict[int, tuple[int, ...]] = {}
    span = {g: (int(c.moment[0]), int(c.moment[-1])) for g, c in courses.items() if len(c.moment)}
    taken = list(chosen)
    for g in sorted(courses.keys() - {*chosen} - images.keys(), key=lambda g: -len(courses[g].moment)):
        if len(courses[g].moment) < LASTS:
            break
        first, last = span[g]
        beside = [h for h in taken if span[h][0] <= last and span[h][1] >= first]
        able = tuple(h for h in chosen if np.isfinite(groups.value(g, h)) and h not in beside)
        if able and most_at_once([span[h] for h in beside], first, last) < len(chosen):
            out[g] = able
            taken.append(g)
    return out


def most_at_once(spans: Sequence[tuple[int, int]], first: int, last: int) -> int:
    """How many of the spans, both ends inside, there are at any one moment from the first to the last, at most."""
    begins = [first, *(a for a, _ in spans if first < a <= last)]
    return max(sum(a <= t <= b for a, b in spans) for t in begins)


def _moves(course: Course) -> bool:
    """Whether a target moves: its places spread more than their changes from moment to moment explain."""
    p = course.place
    if len(p) < 8:
        return True
    jitter = np.median(np.linalg.norm(np.diff(p, axis=0), axis=-1))
    return bool(np.linalg.norm(p.std(axis=0)) > 2 * jitter)


def _outcome(
    groups: Groups,
    tracklets: Sequence[Tracklets],
    chosen: Sequence[int],
    courses: dict[int, Course],
    images: dict[int, int],
    targets: int | None,
    bias: float,
) -> Association:
    may_be = _alternatives(groups, courses, chosen, images) if targets is not None else {}
    order = sorted(chosen, key=lambda g: min(groups.members[g]))
    order += sorted(may_be, key=lambda g: min(groups.members[g]))
    number = {g: k for k, g in enumerate(order)}
    begin = groups.nodes.begin
    trajectory, reason = [], []
    for i in range(len(tracklets)):
        roots = groups.root[int(begin[i]) : int(begin[i + 1])]
        trajectory.append(np.array([number.get(g, NONE) for g in roots], np.intp))
        reason.append(np.array(["" if g in number else _why(groups, g, images) for g in roots], object))
    left = [
        Left(
            "mirror" if g in images else "surplus",
            number.get(images.get(g, NONE), NONE),
            int(c.moment[0]),
            int(c.moment[-1]),
            len(c.moment),
            c.place.mean(0),
        )
        for g, c in sorted(courses.items(), key=lambda item: -len(item[1].moment))
        if g not in number and len(c.moment)
    ]
    return Association(
        tuple(trajectory),
        tuple(reason),
        tuple(_ties(groups, int(i), int(j)) for i, j in pairwise(begin)),
        tuple(next(iter(sorted(groups.names[g]))) if len(groups.names[g]) == 1 else "" for g in order),
        np.array([groups.lead[g] for g in order]),
        tuple(tuple(number[h] for h in may_be.get(g, ())) for g in order),
        tuple(left),
        bias,
    )


def _ties(groups: Groups, begin: int, end: int) -> Ties:
    """How surely the nodes of one camera belong to their groups."""
    lead = np.full(end - begin, np.nan)
    fellow, rival = np.full((end - begin, 2), NONE), np.full((end - begin, 2), NONE)
    starts = groups.nodes.begin
    for k, node in enumerate(range(begin, end)):
        if node in groups.tie:
            tie = groups.tie[node]
            lead[k] = tie.lead
            for out, other in ((fellow, tie.fellow), (rival, tie.rival)):
                if other != NONE:
                    camera = groups.nodes.camera[other]
                    out[k] = camera, other - starts[camera]
    return Ties(lead, fellow, rival)


def _why(groups: Groups, g: int, images: dict[int, int]) -> str:
    """Why a group is no trajectory."""
    if g in images:
        return "mirror"
    if groups.cameras(g) > 1 or groups.n_cameras == 1:
        return "surplus"  # fewer fixes than the trajectories chosen, or too few to be accepted
    if any(groups.value(g, h) > 0 for h in groups.kin[g]):
        return "contested"  # fits another camera's, but so do others
    return "alone"  # no other camera shows it

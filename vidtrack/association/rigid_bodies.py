"""Which courses show which targets of a rigid body: by their distances, which stay the same whatever the body does.

After a stretch in which nothing was seen the motion may say nothing; the distances between what is seen then still say
which target of the body is which. Where several assignments fit (two alike arms, a point and its mirror image), only
what they agree on is used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.association.courses import Course

Body = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Limits:
    """When the distances of courses are those of a body.

    fewest   moments at which two courses are seen together, at least
    members  targets of a body that must be found, at least: two do not say which of them is which
    survey   of the body's largest distance: how wrong its listed places may be
    noise    standard errors of the mean distance that are taken for chance
    steady   standard deviations of the noise within which a distance stays, beside `survey`
    most     assignments that are tried for one body at one time
    """

    fewest: int = 5
    members: int = 3
    survey: float = 0.02
    noise: float = 4.0
    steady: float = 4.0
    most: int = 2000


LIMITS = Limits()


def members_of(courses: Mapping[int, Course], bodies: Sequence[Body]) -> dict[int, str]:
    """The target of a body that each course shows, where that is beyond doubt.

    courses   by their groups
    """
    pairs = {
        (g, h): apart
        for g, h in combinations(sorted(courses), 2)
        if (apart := _distance(courses[g], courses[h])) is not None
    }
    found: dict[int, set[str]] = {}
    for body in bodies:
        for assignments in _by_epoch(courses, pairs, body):
            same = set.intersection(*({(g, n) for n, g in own.items()} for own in assignments))
            for g, name in same:
                found.setdefault(g, set()).add(name)
    return {g: next(iter(names)) for g, names in found.items() if len(names) == 1}


def _distance(one: Course, other: Course) -> tuple[float, float, float] | None:
    """Mean distance of two courses, its standard error, and by how much it changes beyond its noise."""
    _, a, b = np.intersect1d(one.moment, other.moment, assume_unique=True, return_indices=True)
    if a.size < LIMITS.fewest:
        return None
    d = np.linalg.norm(one.place[a] - other.place[b], axis=-1)
    noise = float(np.sqrt(np.median(np.diff(d, 2) ** 2) / 6 / 0.455))  # of normal noise half are below 0.455 variances
    return float(d.mean()), float(d.std() / np.sqrt(d.size)), max(float(d.std()) - LIMITS.steady * noise, 0.0)


def _by_epoch(
    courses: Mapping[int, Course], pairs: Mapping[tuple[int, int], tuple[float, float, float]], body: Body
) -> Iterator[list[dict[str, int]]]:
    """For each time at which something begins the largest assignments of a body's targets to courses that fit."""
    names = list(body)
    places = np.array([body[name] for name in names], float)
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    slack = LIMITS.survey * float(apart.max(initial=0.0))
    seen: set[tuple[int, ...]] = set()
    for moment in sorted({int(c.moment[0]) for c in courses.values() if len(c.moment)}):
        there = tuple(g for g, c in courses.items() if len(c.moment) and c.moment[0] <= moment <= c.moment[-1])
        if len(there) < LIMITS.members or there in seen:
            continue
        seen.add(there)
        found = _assignments(there, pairs, names, apart, slack)
        most = max((len(own) for own in found), default=0)
        if most >= LIMITS.members:
            yield [own for own in found if len(own) == most]


def _assignments(
    there: Sequence[int],
    pairs: Mapping[tuple[int, int], tuple[float, float, float]],
    names: Sequence[str],
    apart: Array,
    slack: float,
) -> list[dict[str, int]]:
    """Ways to give targets courses one by one so that all their distances are those of the body."""
    done: list[dict[str, int]] = []
    waiting: list[tuple[int, dict[str, int]]] = [(0, {})]
    while waiting and len(done) < LIMITS.most:
        k, own = waiting.pop()
        if k == len(names):
            done.append(own)
            continue
        fits = [g for g in there if g not in own.values() and _fits(g, k, own, pairs, names, apart, slack)]
        waiting += [(k + 1, own | {names[k]: g}) for g in fits]
        waiting.append((k + 1, own))
    return done if not waiting else []


def _fits(
    g: int,
    k: int,
    own: Mapping[str, int],
    pairs: Mapping[tuple[int, int], tuple[float, float, float]],
    names: Sequence[str],
    apart: Array,
    slack: float,
) -> bool:
    for name, h in own.items():
        distance = pairs.get((min(g, h), max(g, h)))
        if distance is None:
            return False
        mean, error, change = distance
        if abs(mean - apart[k, names.index(name)]) > slack + LIMITS.noise * error or change > slack:
            return False
    return True

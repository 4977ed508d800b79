"""Which tracklets of a run are one target, by the names that the user gave their tracks or else by association."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array, Bools, Ints
from vidtrack.assignment import one_to_one
from vidtrack.association.associate import NONE, Left, Ties, associate
from vidtrack.association.courses import Course
from vidtrack.association.rigid_bodies import Body, members_of
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.cameras.views import Labels, Seen, View, by_trajectory, of_samples, tracklets_seen
from vidtrack.location.sight_lines.picture_error import unevenness

MAX_SAMPLES = 400
"""Moments, evenly spread, that an error is taken over."""
FEWEST = 5
"""Moments over which a tracklet is judged by itself, at least."""
ELSEWHERE = 0.01
"""Of the weight of the first camera's names, that of the others'."""
GIVEN = 1e6
"""Weight of a name that the user gave, in samples of others."""


class Match(NamedTuple):
    """What `matched` returns: m trajectories."""

    labels: list[str]  # their names
    trajectory: tuple[Ints, ...]  # for each camera (n_pieces,): that of each tracklet; NONE
    reason: tuple[Labels, ...]  # for each camera (n_pieces,): why a tracklet is unused; '' where it is used
    error_px: Array  # (m,) rms distance from the epipolar curves, px
    lead: Array  # (m,) nats by which the least sure join of each is likelier than any other; inf where names decide
    n_common: Ints  # (m,) moments at which two cameras or more saw it
    bias_px: float  # what the calibration was found to leave; NaN where names decide
    part_of: tuple[tuple[int, ...], ...] = ()  # (m,) of which trajectories each may be a part; () where all stand alone
    left: tuple[Left, ...] = ()  # what was located besides
    ties: tuple[Ties, ...] = ()  # for each camera (n_pieces,): what holds each tracklet to its trajectory; () by name

    @property
    def open(self) -> Bools:
        """Which trajectories (m,) may be parts of others."""
        return np.array([bool(several) for several in self.part_of] or [False] * len(self.labels), bool)


def matched(
    views: Sequence[View],
    seen: Sequence[Seen],
    names: list[str] | None,
    limit: int | None,
    tolerance_px: float,
    findings: list[Finding],
    bodies: Sequence[Body] = (),
) -> Match:
    """Which tracklets are one target, and the targets' names; what is doubtful is added to the findings.

    bodies   rigid bodies: their targets with their places in the body
    """
    same = _by_name(views, seen, names)
    if same is not None and not _any_off(views, seen, same, tolerance_px):
        other = _otherwise_by_bodies(views, seen, same, bodies)
        if not other:
            return same
        text = "the distances of targets on rigid bodies say otherwise than their names: " + "; ".join(other)
        cure = "The names by the distances are used. Check targets.csv and the places in bodies."
        findings.append(Finding("doubtful", "names-by-body", text, cure))
    match = _by_association(views, seen, names, limit, tolerance_px, bodies)
    if same is not None:
        if len(match.labels) < len(same.labels):
            return _only_choice(same, tolerance_px, findings)
        findings += _exchanged(views, same, match)
    if not match.labels and all(len(v.named) == 1 for v in views):
        # one target in every camera: there is nothing else that it could be
        label = views[0].named[0]
        alone = [v._replace(tracks=[label if name else "" for name in v.tracks]) for v in views]
        only = _by_name(alone, seen, [label])
        if only is not None:
            return _only_choice(only, tolerance_px, findings)
    return match


def match_errors(cameras: Sequence[Camera], seen: Sequence[ArrayLike]) -> Array:
    """Rms distance (m,), px, of what the cameras see of each target, (m, M, 2) each, from the epipolar curves.

    NaN for a target that no two cameras see at one moment.
    """
    b = [np.asarray(s, float) for s in seen]
    b = [s[:, _spread(b)] for s in b]
    total, n = np.zeros(len(b[0])), np.zeros(len(b[0]))
    for i, j in combinations(range(len(b)), 2):
        d2 = np.maximum(
            epipolar_distance(cameras[i], cameras[j], b[i], b[j]) ** 2,
            epipolar_distance(cameras[j], cameras[i], b[j], b[i]) ** 2,
        )
        total += np.nansum(d2, -1)
        n += np.isfinite(d2).sum(-1)
    return np.sqrt(np.where(n > 0, total, np.nan) / np.maximum(n, 1))


def _spread(b: Sequence[Array]) -> Ints:
    """Up to MAX_SAMPLES of the moments at which two cameras or more see anything, evenly spread."""
    seen = np.sum([np.isfinite(t[..., 0]).any(0) for t in b], 0) >= 2
    moments = np.flatnonzero(seen)
    if not moments.size:
        return np.arange(min(1, b[0].shape[1]))
    return np.asarray(moments[np.linspace(0, moments.size - 1, min(moments.size, MAX_SAMPLES)).round().astype(int)])


def _by_association(
    views: Sequence[View],
    seen: Sequence[Seen],
    names: list[str] | None,
    limit: int | None,
    tolerance_px: float,
    bodies: Sequence[Body],
) -> Match:
    cameras = [v.camera for v in views]
    tracklets, numbers = zip(*(tracklets_seen(s) for s in seen), strict=True)
    given = [np.array(v.given, object)[n].tolist() for v, n in zip(views, numbers, strict=True)]
    uneven = [unevenness(v.camera, v.uncertainty, t.b) for v, t in zip(views, tracklets, strict=True)]
    found = associate(
        cameras, tracklets, targets=limit, tolerance_px=tolerance_px, names=given, bodies=bodies, uneven=uneven
    )
    trajectory, reason = [], []
    for view, number, own, why in zip(views, numbers, found.trajectory, found.reason, strict=True):
        trajectory.append(np.full(view.n_pieces, NONE, np.intp))
        reason.append(np.full(view.n_pieces, "no moment shared", object))
        trajectory[-1][number], reason[-1][number] = own, why
    labels = labels_of(views, seen, trajectory, found.part_of, names, found.names if bodies else ())
    match = _match(views, seen, labels, trajectory, reason, found.lead, found.bias_px)
    ties = tuple(_of_pieces(t, k, numbers, v.n_pieces) for k, (t, v) in enumerate(zip(found.ties, views, strict=True)))
    return match._replace(part_of=found.part_of, left=found.left, ties=ties)


def _of_pieces(ties: Ties, camera: int, numbers: Sequence[Ints], n: int) -> Ties:
    """The ties of a camera's tracklets by their numbers in the cameras."""
    lead = np.full(n, np.nan)
    lead[numbers[camera]] = ties.lead
    pairs = []
    for pair in (ties.fellow, ties.rival):
        out = np.full((n, 2), NONE)
        real = np.flatnonzero(pair[:, 0] != NONE)
        which = [numbers[c][k] for c, k in pair[real].tolist()]
        out[numbers[camera][real]] = np.stack([pair[real, 0], np.array(which, np.intp)], -1)
        pairs.append(out)
    return Ties(lead, *pairs)


def _otherwise_by_bodies(views: Sequence[View], seen: Sequence[Seen], same: Match, bodies: Sequence[Body]) -> list[str]:
    """What targets are by the distances on rigid bodies, where that is not what they are called."""
    if not bodies:
        return []
    m = len(same.labels)
    b, sd = (
        np.stack([by_trajectory(x, s.piece, t, m) for x, s, t in zip(values, seen, same.trajectory, strict=True)])
        for values in ([s.b for s in seen], [s.sd for s in seen])
    )
    place = locate_points([v.camera for v in views], b, sd=np.nan_to_num(sd, nan=1.0)).point
    moments = [np.flatnonzero(np.isfinite(p[:, 0])) for p in place]
    courses = {k: Course(at, place[k, at], np.ones(at.size, np.intp)) for k, at in enumerate(moments) if at.size}
    return [f"{same.labels[k]} is {name}" for k, name in members_of(courses, bodies).items() if name != same.labels[k]]


def _match(
    views: Sequence[View],
    seen: Sequence[Seen],
    labels: list[str],
    trajectory: Sequence[Ints],
    reason: Sequence[Labels],
    lead: Array,
    bias_px: float,
) -> Match:
    b = [by_trajectory(s.b, s.piece, t, len(labels)) for s, t in zip(seen, trajectory, strict=True)]
    common = (np.sum([np.isfinite(x[..., 0]) for x in b], 0) >= 2).sum(-1)
    error = match_errors([v.camera for v in views], b)
    return Match(labels, tuple(trajectory), tuple(reason), error, lead, common, bias_px)


def _only_choice(match: Match, tolerance_px: float, findings: list[Finding]) -> Match:
    """A match by name or number that the epipolar lines contradict; there is no other."""
    never = int(np.isnan(match.error_px).sum())
    if never:
        text = f"{never} of {len(match.error_px)} targets: no two cameras saw them at one moment"
        findings.append(Finding("bad", "never-seen-together", text, "See in the tracks when each camera saw them."))
    worst = float(np.nanmax(match.error_px, initial=0.0))
    if worst > tolerance_px:
        text = (
            f"targets are matched by name or number alone: their tracks lie {worst:.3g} px rms off each other's "
            f"epipolar lines (limit {tolerance_px:g} px)"
        )
        cure = "Where two cameras disagree no position is given. Check names, clocks and calibrations of these cameras."
        findings.append(Finding("bad", "match-contradicted", text, cure))
    return match


def _exchanged(views: Sequence[View], same: Match, match: Match) -> list[Finding]:
    """Whether names mean different targets from the start, or tracks went over to other targets later."""
    named = [_shown(v, t, match.labels, first=True) for v, t in zip(views, match.trajectory, strict=True)]
    wrong = []
    for view, own in zip(views, named, strict=True):
        for track, label in own:
            fellows = [
                f"{v.name}'s {other}"
                for v, theirs in zip(views, named, strict=True)
                for other, name in theirs
                if v is not view and name == label and other != track
            ]
            if label != track and fellows:
                wrong.append(f"{view.name}'s {track} is {' and '.join(fellows)}")
    gain = (
        f"As named, tracks lie up to {float(np.nanmax(same.error_px, initial=0.0)):.3g} px rms off each other's "
        f"epipolar lines; so matched, {float(np.nanmax(match.error_px, initial=0.0)):.3g} px. The latter is used"
    )
    if wrong:
        text = f"targets.csv: names do not agree between cameras: {'; '.join(wrong[:6])}. {gain}"
        return [Finding("doubtful", "names-exchanged", text, "Correct the names in targets.csv.")]
    later = [
        f"{view.name}'s {track} shows {', '.join(shown)}"
        for view, own in zip(views, match.trajectory, strict=True)
        for track, shown in _several(_shown(view, own, match.labels)).items()
    ]
    if not later:
        return []
    text = f"where targets met, tracks went over to others: {'; '.join(later[:6])}. {gain}"
    return [Finding("note", "tracks-exchanged", text, "Nothing, where positions are smooth; see the tracks there.")]


def _several(shown: Sequence[tuple[str, str]]) -> dict[str, list[str]]:
    """The tracks that show more than one target, or one of another name."""
    of = {track: [label for own, label in shown if own == track] for track, _ in shown}
    return {track: labels for track, labels in of.items() if labels != [track]}


def _shown(view: View, trajectory: Ints, labels: Sequence[str], *, first: bool = False) -> list[tuple[str, str]]:
    """Each track of a camera with the name of each target that it shows; `first`: that it begins with."""
    whose = of_samples(view.piece, trajectory)
    out = []
    for track, own in zip(view.tracks, whose, strict=True):
        known = own[own != NONE]
        if track:
            out += [(track, labels[k]) for k in (known[:1] if first else np.unique(known)).tolist()]
    return out


def _by_name(views: Sequence[View], seen: Sequence[Seen], names: list[str] | None) -> Match | None:
    """The match by names, where the user gave them and every track bears one."""
    if names is None or not all(set(v.named) <= set(names) for v in views):
        return None
    shown = [n for n in names if any(n in v.tracks for v in views)]
    trajectory, reason = [], []
    for v in views:
        own = np.full(v.n_pieces, NONE, np.intp)
        track, sample = np.nonzero(v.piece != NONE)
        which = np.array([shown.index(n) if n else NONE for n in v.tracks], np.intp)
        own[v.piece[track, sample]] = which[track]
        trajectory.append(own)
        reason.append(np.where(own == NONE, "unnamed", "").astype(object))
    return _match(views, seen, shown, trajectory, reason, np.full(len(shown), np.inf), float("nan"))


def _any_off(views: Sequence[View], seen: Sequence[Seen], same: Match, tolerance_px: float) -> bool:
    """Whether any target, or any tracklet of one, lies off its epipolar lines by more than the tolerance, rms."""
    if (same.error_px > tolerance_px).any():
        return True
    m = len(same.labels)
    b = [by_trajectory(s.b, s.piece, t, m) for s, t in zip(seen, same.trajectory, strict=True)]
    for i, s in enumerate(seen):
        whose = of_samples(s.piece, same.trajectory[i])
        track, moment = np.nonzero(whose != NONE)
        piece = s.piece[track, moment]
        for j in range(len(seen)):
            if j == i:
                continue
            there = b[j][whose[track, moment], moment]
            d2 = epipolar_distance(views[j].camera, views[i].camera, there, s.b[track, moment]) ** 2
            known = np.isfinite(d2)
            n = np.bincount(piece[known], minlength=views[i].n_pieces)
            total = np.bincount(piece[known], d2[known], minlength=views[i].n_pieces)
            if (total > tolerance_px**2 * n)[n >= FEWEST].any():
                return True
    return False


def labels_of(
    views: Sequence[View],
    seen: Sequence[Seen],
    trajectory: Sequence[Ints],
    part_of: Sequence[tuple[int, ...]],
    names: list[str] | None,
    by_body: Sequence[str] = (),
) -> list[str]:
    """Each trajectory's name: that of the tracks that show it, one to one; a|b, a|b#2 for parts of a or b.

    by_body   the name that a rigid body gives each trajectory, '' where none does
    Names by bodies come first. Names that the user gave hold where a track begins, in its start box, and most cameras
    decide; others hold as long as they are followed, and the first camera decides.
    """
    m = sum(not several for several in part_of)
    trajectory = [np.where(own < m, own, NONE) for own in trajectory]
    known = list(dict.fromkeys([*(names or []), *filter(None, by_body), *(n for v in views for n in v.named)]))
    votes = np.zeros((m, len(known)))
    for row, name in zip(votes, by_body, strict=False):
        if name:
            row[known.index(name)] += GIVEN**2
    for i, (view, s, own) in enumerate(zip(views, seen, trajectory, strict=True)):
        whose = of_samples(s.piece, own)
        for name, piece, row in zip(view.tracks, s.piece, whose, strict=True):
            if not name:
                continue
            column = known.index(name)
            weight = 1.0 if i == 0 else ELSEWHERE
            there = np.flatnonzero(piece != NONE)
            bound = there.size > 0 and bool(view.bound[piece[there[0]]])
            if bound or (names is not None and name in names and there.size):
                row = np.where(piece == piece[there[0]], row, NONE)
                weight = GIVEN * (1 + ELSEWHERE * (i == 0)) / there.size
            np.add.at(votes[:, column], row[row != NONE], weight)
    labels = [""] * m
    for k, best in enumerate(one_to_one(-votes).tolist()):
        if best >= 0 and votes[k, best] > 0:
            labels[k] = known[best]
    free = (f"t{i}" for i in range(1, 2 * m + len(known) + 1) if f"t{i}" not in known)
    labels = [label or next(free) for label in labels]
    for several in part_of[m:]:
        label = "|".join(labels[k] for k in several)
        more = sum(other.split("#")[0] == label for other in labels)
        labels.append(f"{label}#{more + 1}" if more else label)
    return labels

"""What mistake put surveyed points where they are not: a wire hung elsewhere, exchanged names, typing.

All from the places where the cameras together see the points (`surveys.survey`), with their standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.camera.outliers import Mask
from vidtrack.calibration.surveys.survey import Placed, lines_of
from vidtrack.findings import Finding

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class MistakeSettings:
    """Constants of the explanations."""

    sure: float = 4.0
    """Standard deviations, of the place and of the survey together, within which two places are the same."""

    most_of: float = 0.75
    """Share of a line's points that must be misplaced for the line to be misplaced."""

    least_turn_deg: float = 0.5
    """A line that turned by less is said to have moved only."""

    factors: tuple[tuple[float, str], ...] = (
        (-1.0, "its sign is wrong"),
        (25.4, "it is in inches among millimetres"),
        (1 / 25.4, "it is in millimetres among inches"),
        (2.54, "it is in inches among centimetres"),
        (1 / 2.54, "it is in centimetres among inches"),
        (12.0, "it is in feet among inches"),
        (1 / 12.0, "it is in inches among feet"),
        (0.3048, "it is in feet among metres"),
        (1 / 0.3048, "it is in metres among feet"),
        (10.0, "its decimal point is one place too far left"),
        (0.1, "its decimal point is one place too far right"),
        (100.0, "its decimal point is two places too far left"),
        (0.01, "its decimal point is two places too far right"),
        (1000.0, "its decimal point is three places too far left"),
        (0.001, "its decimal point is three places too far right"),
    )
    """By what a coordinate must be multiplied, and what that means."""


SETTINGS = MistakeSettings()


class Survey(NamedTuple):
    """What points.csv says of n points, and where the cameras put them."""

    tags: Sequence[str]
    p: Array  # (n, 3) world units
    placed: Placed
    units: str

    def same(self, there: Array, j: int) -> bool:
        """Whether a place (3,) is where the cameras put point j."""
        sd = np.sqrt(self.placed.sd[j] ** 2 + self.placed.spread**2)
        return bool((np.abs(there - self.placed.place[j]) <= SETTINGS.sure * sd).all())

    def shift(self, j: int) -> Array:
        """From the survey's place to the cameras', (3,)."""
        return np.asarray(self.placed.place[j] - self.p[j])


def survey_findings(survey: Survey, groups: Sequence[tuple[str, Mask]] = ()) -> list[Finding]:
    """A finding for each mistake of the survey. groups: names of sets of points (n,), clips as a rule."""
    left = survey.placed.misplaced.copy()
    findings = []
    for name, line in _lines(survey, groups):
        if left[line].sum() < max(3, SETTINGS.most_of * line.sum()):
            continue
        members = np.flatnonzero(line & survey.placed.misplaced)
        findings.append(_of_line(survey, name, members))
        left[members] = False
    for i in np.flatnonzero(left).tolist():
        if not left[i]:
            continue
        other = next((k for k in range(len(survey.p)) if k != i and survey.same(survey.p[k], i)), None)
        if other is not None and left[other] and survey.same(survey.p[i], other):
            findings.append(_exchanged(survey, i, other))
            left[[i, other]] = False
        else:
            findings.append(_of_point(survey, i, other))
            left[i] = False
    unclear = [survey.tags[j] for j in np.flatnonzero(survey.placed.unclear).tolist()]
    if unclear:
        text = (
            f"the cameras agree on no place for tag{'s' * (len(unclear) > 1)} {', '.join(unclear)}: more than one of "
            "them takes something else for it. It was not used."
        )
        cure = "Pick the point by hand in each camera's picks.csv, or remove it from points.csv."
        findings.append(Finding("doubtful", "point-unclear", text, cure))
    return findings


def _lines(survey: Survey, groups: Sequence[tuple[str, Mask]]) -> list[tuple[str, Mask]]:
    """Lines of points and groups, those with most misplaced points first."""
    every = [*groups, *(("", line) for line in lines_of(survey.p))]
    misplaced = survey.placed.misplaced
    return sorted(every, key=lambda each: (-int((each[1] & misplaced).sum()), int(each[1].sum())))


def _of_line(survey: Survey, name: str, members: NDArray[np.intp]) -> Finding:
    tags = ", ".join(survey.tags[j] for j in members)
    p, x = survey.p[members], survey.placed.place[members]
    shift = (x - p).mean(0)
    head = f"the wire or row of tags {tags}" if not name else f"the points of {name} (tags {tags})"
    if order := _order(survey, members):
        text = f"{head}: all cameras see {order}. They were not used."
        return Finding("doubtful", "tags-out-of-order", text, "Correct the order of these tags in points.csv.")
    R = _turn(p - p.mean(0), x - x.mean(0))
    after = (p - p.mean(0)) @ R.T + x.mean(0)
    sd = np.sqrt(survey.placed.sd[members] ** 2 + survey.placed.spread**2)
    rigid = bool((np.abs(after - x) <= SETTINGS.sure * sd).all())
    along = _axis(p)
    angle = float(np.degrees(np.arccos(np.clip(_axis(x) @ along, -1, 1))))
    plain = bool((np.abs(p + shift - x) <= SETTINGS.sure * sd).all())
    how = f"all cameras see it {_length(survey, shift)} from its surveyed place, at {_vector(survey, shift)}"
    if not plain and angle > SETTINGS.least_turn_deg:
        how += f", turned by {angle:.2g} degrees"
    elif plain and np.linalg.norm(shift - (shift @ along) * along) < 0.1 * np.linalg.norm(shift):
        how += ", along itself"
    if not rigid:
        how += ", and not as one piece"
    text = f"{head} {'lies elsewhere' if not name else 'lie elsewhere'}: {how}. These points were not used."
    cure = "Survey these points again, or correct points.csv by that shift if you know what was measured wrongly."
    return Finding("doubtful", "wire-misplaced", text, cure)


def _order(survey: Survey, members: NDArray[np.intp]) -> str:
    """How the tags of a line are out of order; empty where they are not."""
    p = survey.p[members]
    ranked = members[np.argsort((p - p.mean(0)) @ _axis(p), kind="stable")]
    n = len(ranked)
    for shift in (1, -1):
        pairs = [(ranked[k], ranked[k + shift]) for k in range(n) if 0 <= k + shift < n]
        if len(pairs) >= 2 and all(survey.same(survey.p[b], a) for a, b in pairs):
            return "each tag at the place of the next one: its tags are shifted by one"
    if all(survey.same(survey.p[b], a) for a, b in zip(ranked, ranked[::-1], strict=True)):
        return "them in the opposite order"
    return ""


def _exchanged(survey: Survey, i: int, j: int) -> Finding:
    text = (
        f"tags {survey.tags[i]} and {survey.tags[j]} are exchanged in the survey: every camera sees each where the "
        f"other should be, {_length(survey, survey.p[j] - survey.p[i])} away. Both were not used."
    )
    return Finding("doubtful", "tags-exchanged", text, "Exchange their coordinates in points.csv.")


def _of_point(survey: Survey, j: int, other: int | None) -> Finding:
    shift = survey.shift(j)
    text = (
        f"tag {survey.tags[j]} is misplaced in the survey: all cameras see it {_length(survey, shift)} from its "
        f"surveyed place, at {_vector(survey, shift)}. It was not used."
    )
    if other is not None:
        cure = f"It lies where tag {survey.tags[other]} is surveyed: check both names in points.csv."
    elif mistake := typing_mistake(survey.p[j], survey.placed.place[j], _sd(survey, j)):
        cure = f"In points.csv {mistake}."
    else:
        where = ", ".join(f"{v:.6g}" for v in _rounded(survey.placed.place[j], survey.placed.sd[j]))
        cure = f"Survey the point again (the cameras see it at {where}), or remove it from points.csv."
    return Finding("doubtful", "point-misplaced", text, cure)


def _sd(survey: Survey, j: int) -> Array:
    return np.asarray(np.sqrt(survey.placed.sd[j] ** 2 + survey.placed.spread**2))


def typing_mistake(p: Array, x: Array, sd: Array) -> str:
    """What may have gone wrong when the coordinates p (3,) were written, which the cameras see at x (3,) +- sd (3,).

    Two coordinates exchanged, a wrong sign or unit, a decimal point, two digits exchanged, one digit wrong. Empty where
    none of these explains it, or where more than one coordinate differs and no common cause does.
    """
    near = SETTINGS.sure * sd
    for a, b in ((0, 1), (0, 2), (1, 2)):
        swapped = p.copy()
        swapped[[a, b]] = p[[b, a]]
        if (np.abs(swapped - x) <= near).all():
            return f"its {AXES[a]} and {AXES[b]} are exchanged"
    for factor, _ in SETTINGS.factors:
        differ = np.abs(p - x) > near
        if differ.sum() > 1 and (np.abs(p[differ] * factor - x[differ]) <= near[differ]).all():
            return f"its {' and '.join(AXES[k] for k in np.flatnonzero(differ))} must be multiplied by {factor:.5g}"
    off = np.flatnonzero(np.abs(p - x) > near).tolist()
    if len(off) != 1:
        return ""
    k = off[0]
    factor, why = min(SETTINGS.factors, key=lambda each: abs(p[k] * each[0] - x[k]))
    if abs(p[k] * factor - x[k]) <= near[k] and abs(p[k]) > near[k]:
        return f"its {AXES[k]} {p[k]:g} should be about {x[k]:.6g}: {why}"
    if (digits := _exchanged_digits(float(p[k]), float(x[k]), float(near[k]))) is not None:
        return f"its {AXES[k]} {p[k]:g} should be about {x[k]:.6g}: two digits exchanged ({digits})"
    if (digits := _wrong_digit(float(p[k]), float(x[k]), float(near[k]))) is not None:
        return f"its {AXES[k]} {p[k]:g} should be about {x[k]:.6g}: one digit wrong ({digits})"
    return f"its {AXES[k]} {p[k]:g} should be about {x[k]:.6g}"


def _exchanged_digits(value: float, wanted: float, near: float) -> str | None:
    text = f"{value:.10g}"
    places = [i for i, c in enumerate(text) if c.isdigit()]
    for a, b in pairwise(places):
        changed = list(text)
        changed[a], changed[b] = changed[b], changed[a]
        if changed != list(text) and abs(float("".join(changed)) - wanted) <= near:
            return "".join(changed)
    return None


def _wrong_digit(value: float, wanted: float, near: float) -> str | None:
    text = f"{value:.10g}"
    fits = []
    for i, c in enumerate(text):
        for other in "0123456789" if c.isdigit() else "":
            changed = text[:i] + other + text[i + 1 :]
            if other != c and abs(float(changed) - wanted) <= near:
                fits.append(changed)
    return min(fits, key=lambda each: abs(float(each) - wanted)) if fits else None


def _axis(p: Array) -> Array:
    """The direction (3,) of points (k, 3), from the first to the last."""
    unit = np.linalg.svd(p - p.mean(0), full_matrices=False)[2][0]
    return np.asarray(unit if (p[-1] - p[0]) @ unit >= 0 else -unit)


def _turn(a: Array, b: Array) -> Array:
    """The rotation (3, 3) that takes points a (k, 3) about their mean nearest to b (Kabsch 1976)."""
    U, _, Vt = np.linalg.svd(b.T @ a)
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)


def _length(survey: Survey, shift: Array) -> str:
    return f"{np.linalg.norm(shift):.3g} {survey.units}".strip()


def _vector(survey: Survey, shift: Array) -> str:
    return "(" + ", ".join(f"{axis} {value:+.3g}" for axis, value in zip(AXES, shift, strict=True)) + ")"


def _rounded(x: Array, sd: Array) -> list[float]:
    digits = np.maximum(1 - np.floor(np.log10(np.maximum(sd, 1e-9))), 0).astype(int)
    return [round(v, d) for v, d in zip(x.tolist(), digits.tolist(), strict=True)]

"""What the checks find of a camera that can be had: outliers, poor geometry, a lens or a noise that does not fit."""

from __future__ import annotations

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera import gates
from vidtrack.calibration.camera.centre_search import REACH_PX
from vidtrack.calibration.camera.diagnosis import left_out
from vidtrack.calibration.camera.known_lens import LIMITS, KnownLens, places
from vidtrack.calibration.camera.one_camera import (
    ENOUGH_TO_JUDGE,
    RICH_LENS_POINTS,
    Answer,
    Inliers,
    Points,
    Task,
    fit_points,
)
from vidtrack.calibration.camera.outliers import ENOUGH, Mixup
from vidtrack.calibration.camera.refine import POSE, free_parameters, refine
from vidtrack.calibration.refraction.interface_evidence import interface_findings, unexplained
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import RICHEST

CONVERTED_PX = 0.1
"""px, largest error of a converted lens beyond which it is worse than a good centroid."""

CONTRADICTED = 2.0
"""Times by which the noise must fall when f and the centre are freed, before a known lens is doubted."""

ENOUGH_FOR_ALL = 16
"""Points from which what the config says of a lens can be doubted, all of it being freed."""

ENOUGH_TO_DOUBT = 8
"""Points from which a known lens can be doubted: 16 equations for 9 unknowns."""


def lens_findings(lens: KnownLens, answer: Answer, good: Points, tags: list[str], units: str) -> list[Finding]:
    """What a camera with a known lens should say: where the lens is from, and what the points say of it.

    tags  of all points that were offered
    """
    held = "held" if not lens.names else "known with a covariance, which is its prior"
    text = f"the lens is that of {lens.source}, {held}"
    if lens.largest_px:
        text += f"; converted, with {lens.largest_px:.2g} px at most and {lens.rms_px:.2g} px rms over the picture"
    findings = [Finding("note", "lens-known", f"{text}.")]
    if lens.largest_px > CONVERTED_PX:
        text = f"no lens model here comes nearer to the lens of {lens.source} than {lens.largest_px:.2g} px."
        cure = "Calibrate the lens here (a board), or keep targets away from the picture's corners."
        findings.append(Finding("doubtful", "lens-converted-roughly", text, cure))
    here = answer.camera.position
    for rival in answer.rivals:
        other = rival.fit.camera.position
        place = ", ".join(f"{value:.4g}" for value in other)
        apart = float(np.linalg.norm(other - here))
        text = f"the points fit a second place of the camera as well, {apart:.3g} {units} away, at ({place})."
        findings.append(Finding("doubtful", "place-ambiguous", text, "Add a point off their plane, or a fifth one."))
    if answer.suspect >= 0:
        text = (
            f"{good.n} points disagree, and least without tag {tags[answer.suspect]}: one of them is wrong, and they "
            "are too few to leave it out."
        )
        findings.append(Finding("bad", "point-suspect", text, "Check its pick and its survey, or add points."))
    if good.n >= ENOUGH_TO_DOUBT and (doubt := _contradicted(lens, answer, good)):
        findings.append(doubt)
    return findings


def _contradicted(lens: KnownLens, answer: Answer, good: Points) -> Finding | None:
    """Whether the points fit much better with another focal length and centre."""
    free = (*POSE, "f", "Cx", "Cy")
    other = refine(answer.camera, good.p, good.b, free=free, sd=good.sd, survey=good.survey, max_iterations=50)
    if not (other.converged and other.sigma_px * CONTRADICTED < answer.fit.sigma_px):
        return None
    f = 100 * (other.camera.f / answer.camera.f - 1)
    shift = other.camera.Cx - answer.camera.Cx, other.camera.Cy - answer.camera.Cy
    text = (
        f"the points contradict the lens of {lens.source}: with f {f:+.2g} % and the centre {shift[0]:+.2g}, "
        f"{shift[1]:+.2g} px elsewhere they leave {other.sigma_px:.2g} px instead of {answer.fit.sigma_px:.2g}."
    )
    return Finding("bad", "lens-contradicted", text, "Was it calibrated at this focus, zoom and picture size?")


def mirrored_place(lens: KnownLens, points: Points, sigma_px: float) -> bool:
    """Whether the points fit a mirrored world much better than the one surveyed, from few points."""
    mirror = places(lens.camera, points.p * [-1.0, 1.0, 1.0], points.b, points.sd, points.survey)
    return bool(mirror) and not points.coplanar and mirror[0].fit.sigma_px * 10 < sigma_px


def outlier_findings(
    tags: list[str],
    points: Points,
    found: Inliers,
    errors: Array,
    mixed: list[Mixup],
    answer: Answer,
    *,
    known_lens: bool,
) -> list[Finding]:
    """What was left out: tags that are swapped, and other outliers with their likeliest cause.

    errors  (n, 2) px, measured minus projected, of all points; found says which were kept
    """
    pairs = [m for m in mixed if m.mutual and m.point < m.place]
    findings = [gates.swapped(tags[m.point], tags[m.place]) for m in pairs]
    rest = ~found.keep
    rest[[i for m in pairs for i in (m.point, m.place)]] = False
    far = float(np.nanmax(np.hypot(*errors[rest].T), initial=0.0))
    clips = [""] * len(tags) if points.clips is None else points.clips.tolist()
    centre = (answer.camera.Cx, answer.camera.Cy)
    if finding := left_out(tags, clips, points.p, points.b, rest, centre, far, answer.model):
        findings.append(finding)
    if len(tags) < (LIMITS.fewest_to_reject if known_lens else ENOUGH):
        text = f"{len(tags)} points are too few to find an outlier among."
        enough = LIMITS.fewest_to_reject if known_lens else ENOUGH
        findings.append(Finding("note", "outliers-not-sought", text, f"Use {enough} or more."))
    return findings


def doubts(stated: Points, good: Points, task: Task, answer: Answer, units: str) -> list[Finding]:
    """What the checks find of a camera that can be had; `stated` has the noise as it was given."""
    camera, fit = answer.camera, answer.fit
    held = task.lens is not None and not task.lens.names  # a lens that is held is not extrapolated
    findings = [
        gates.nearly_coplanar(good.p),
        gates.folded(camera),
        None if held else gates.bunched(good.b, task.nominal.image_size),
        gates.unsure(camera, answer.uncertainty),
    ]
    if good.coplanar:
        text = f"points in one plane: Tsai's coplanar method, with Sx held at {camera.Sx:g}."
        findings += [Finding("note", "points-coplanar", text), gates.facing(camera, good.p)]
    if answer.at_edge:
        findings.append(gates.at_edge(task.nominal.Cx, task.nominal.Cy, REACH_PX))
    if fit.message:
        cure = "Add points, or hold parameters with calibration.fix."
        findings.append(Finding("doubtful", "fit-not-settled", f"{fit.message}.", cure))
    findings.append(_settings_contradicted(good, task, answer))
    plain = None
    if not (task.closed or task.fixed or task.model in ("auto", RICHEST)):
        plain = gates.plain_lens(fit.sigma_px, _noise_with_rich_lens(good, task, camera), answer.model)
        findings.append(plain)
    if plain is None and not task.closed:
        findings.append(unexplained(stated, answer, units))
    if not task.closed:
        findings += interface_findings(stated, good, answer, units)
    return [finding for finding in findings if finding]


def _settings_contradicted(good: Points, task: Task, answer: Answer) -> Finding | None:
    """Whether the points fit much better without what calibration.fix and calibration.prior say of the lens."""
    given = [name for name in free_parameters(answer.model) if name in task.fixed or name in task.priors]
    if task.closed or task.lens is not None or answer.camera.through or not given or good.coplanar:
        return None
    if good.n < ENOUGH_FOR_ALL:
        return None
    free = free_parameters(answer.model)
    other = refine(answer.camera, good.p, good.b, free=free, sd=good.sd, survey=good.survey, max_iterations=50)
    if not (other.converged and other.sigma_px * CONTRADICTED < answer.fit.sigma_px):
        return None
    values = ", ".join(f"{n} {getattr(other.camera, n):.4g}, not {getattr(answer.camera, n):.4g}" for n in given)
    text = (
        f"the points contradict calibration.fix or calibration.prior: without them {values}, and "
        f"{other.sigma_px:.2g} px are left instead of {answer.fit.sigma_px:.2g}."
    )
    return Finding("doubtful", "settings-contradicted", text, "Correct the values there, or take them out.")


def _noise_with_rich_lens(points: Points, task: Task, near: Camera) -> float:
    """The noise, px, that the richest lens leaves, its parameters counted; NaN where the points are too few."""
    if points.n < RICH_LENS_POINTS:
        return float("nan")
    fit = fit_points(points.thinned(ENOUGH_TO_JUDGE), task._replace(priors={}), RICHEST, near)
    return fit.sigma_px if fit else float("nan")

"""What one camera's points say of refraction: an interface that lies elsewhere than the config says, or is missing.

A camera is fitted once more with its interfaces hardly known beforehand or, where it has none, with a surface of water
somewhere on the way; both fits are compared by the noise that they leave. Seen square on, water looks like a lens and
a longer focal length: then the points do not ask for it, and no finding is made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vidtrack.calibration.camera.diagnosis import misfit
from vidtrack.calibration.camera.initial_fit import Nominal, distances, fit_camera, starts
from vidtrack.calibration.camera.one_camera import Answer, Points
from vidtrack.calibration.camera.refine import Fit, covariances, refine
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.interface import Interface
from vidtrack.geometry.jacobian import derivatives


@dataclass(frozen=True)
class EvidenceSettings:
    """Constants of the comparison."""

    fewest: int = 30
    """Points from which an interface can be distinguished from a lens."""

    most: int = 300
    """Points that are looked at."""

    share: float = 0.9
    """Noise left over, as a share of that without, from which an interface is asked for."""

    nats: float = 20.0
    """Gain of the log likelihood from which it is no chance; 3 to 5 parameters alone give 2 or 3."""

    explained: float = 1.15
    """Noise left over, times the stated one, below which nothing is missing: of 30 points it varies by 10 %."""

    usual_px: float = 0.15
    """ASSUME: noise of centroids, where nothing is stated."""

    off: float = 4.0
    """Standard deviations of what is known beforehand beyond which an interface is not where the config says."""

    gained: float = 0.05
    """Share of a parameter's variance that the points must take away, for them to say anything of it."""

    learned: float = 0.8
    """Standard deviation of a place, over what the config says of it, below which the points have shown it."""

    loose_position: float = 0.3
    """Standard deviation of a place that is hardly known, as a share of the distance from the camera to the points."""

    loose_tilt: float = 0.3
    """rad"""

    loose_index: float = 0.15


SETTINGS = EvidenceSettings()
WATER = (1.0, 1.333)


def interface_findings(stated: Points, points: Points, answer: Answer, units: str) -> list[Finding]:
    """What the points say against the interfaces that the camera has or has not; text without the camera's name.

    stated   the points with the noise as it was given: where the fit leaves no more, no interface is missing
    """
    if unused := _unused(answer.camera, points):
        return _nothing_behind(unused, stated, points, answer)
    if answer.camera.through:
        found = [_off(interface, answer, units) for interface in answer.camera.through]
        wrong = [each for each in found if each] or _moved(points, answer, units)
        return wrong or _unchecked(points, answer, units)
    return [] if _explained(stated, answer) else _missing(points, answer)


def _unused(camera: Camera, points: Points) -> list[str]:
    """The camera's interfaces, where all points lie on its side of each of them."""
    names = []
    for interface in camera.through:
        side = np.sign((interface.point - camera.position) @ interface.normal)
        if (side * ((points.p - interface.point) @ interface.normal) > 0).any():
            return []
        names.append(interface.name)
    return names


def _nothing_behind(names: list[str], stated: Points, points: Points, answer: Answer) -> list[Finding]:
    """Interfaces that no point is seen through: a wrong place, if the points look as seen through water."""
    text = (
        f"interface {' and '.join(names)}: all points lie on the camera's side of it, so that none of them shows where "
        "it is"
    )
    wet = [] if _explained(stated, answer) else _missing(points, answer)
    if not wet:
        cure = "If the points were filmed through it, correct its point or normal under interfaces in config.yaml."
        return [Finding("note", "interface-unused", text + ".", cure)]
    cure = "Correct its point or normal under interfaces in config.yaml."
    return [Finding("doubtful", "interface-wrong", f"{text}, and {each.text}", cure) for each in wet]


def _off(interface: Interface, answer: Answer, units: str) -> Finding | None:
    """Whether an interface was refined to far from where it is known to be.

    What the points and the config say of a parameter differs from the config by d sd^2 / (sd^2 - s^2), where the
    refinement moved it by d and left s of what was known, sd: d is to be compared with the root of sd^2 - s^2.
    """
    far = {}
    for each, (shift, sd) in interface.pull.items():
        left = _left(answer, each)
        gained = max(sd**2 - left**2, SETTINGS.gained * sd**2)
        far[each] = -shift / float(np.sqrt(gained))
    name = max(far, key=lambda each: abs(far[each]), default=None)
    if name is None or abs(far[name]) <= SETTINGS.off:
        return None
    shift, _ = interface.pull[name]
    text = (
        f"interface {interface.name}: the points move its {_kind(name)} by {_amount(name, -shift, units)}, "
        f"{abs(far[name]):.0f} standard deviations from what the config says."
    )
    return Finding("doubtful", "interface-wrong", text, _CURE)


def _unchecked(points: Points, answer: Answer, units: str) -> list[Finding]:
    """Interfaces of whose place along their normal the points, all beyond them, say nothing."""
    found = []
    known = answer.uncertainty
    for interface in answer.camera.through:
        name = interface.parameters[0]
        side = np.sign((interface.point - answer.camera.position) @ interface.normal)
        all_beyond = (side * ((points.p - interface.point) @ interface.normal) > 0).all()
        found += _taken(interface, answer, units)
        if name not in known.names or not all_beyond:
            continue
        prior = interface.pull[name][1]
        if _left(answer, name) < SETTINGS.learned * prior:
            continue
        text = (
            f"interface {interface.name}: all points lie beyond it and do not check its place along its normal, which "
            f"is known to {prior:.3g} {units} from the config alone. What lies beyond it is located nearly as well "
            "wherever it is; the camera, and what lies before it, are not"
        )
        cure = "Measure its place with care, or survey one more point on the camera's side of it."
        found.append(Finding("note", "interface-place-unchecked", text + ".", cure))
    return found


def _taken(interface: Interface, answer: Answer, units: str) -> list[Finding]:
    """Thicknesses and indices of which the points say no more than the config does."""
    taken = []
    for name, (_, prior) in interface.pull.items():
        kind = _kind(name)
        if kind.split()[0] in ("thickness", "index") and _left(answer, name) >= SETTINGS.learned * prior:
            taken.append(f"{kind} (to {prior:.2g}{'' if kind.startswith('index') else ' ' + units})")
    if not taken:
        return []
    text = (
        f"interface {interface.name}: the points do not check its {', '.join(taken)}: these are taken from the config, "
        "and how well they are known is in the sigma of what is located."
    )
    cure = "A wrong one shows only where points lie on both sides of it, or far apart in depth: measure them."
    return [Finding("note", "interface-unchecked", text, cure)]


def _left(answer: Answer, name: str) -> float:
    """The standard deviation that a refinement left of a parameter, noise as stated."""
    known = answer.uncertainty
    if name not in known.names:
        return 0.0
    k = known.names.index(name)
    misfit = answer.fit.misfit
    return float(np.sqrt(known.covariance[k, k])) / (misfit if np.isfinite(misfit) and misfit > 0 else 1.0)


def _moved(points: Points, answer: Answer, units: str) -> list[Finding]:
    """Whether interfaces that are held, or known too well, would explain the points better elsewhere."""
    camera = answer.camera
    depth = _depth(camera, points)
    loose = tuple(_loose(interface, depth) for interface in camera.through)
    few = points.thinned(SETTINGS.most)
    names = [name for name in answer.uncertainty.names if "." not in name]
    before, after = (
        refine(camera.with_(through=through), few.p, few.b, free=names, sd=few.sd, survey=few.survey, tolerance=1e-6)
        for through in (camera.through, loose)
    )
    if not _better(before, after, few.n):
        return []
    found = []
    for interface, now in zip(camera.through, after.camera.through, strict=True):
        off = dict(zip(now.parameters, now.deviation(interface), strict=True))
        moved = ", ".join(f"{_kind(name)} {_amount(name, off[name], units)}" for name in now.free)
        text = (
            f"interface {interface.name}: the points contradict it: as it is they leave {before.sigma_px:.2g} px, "
            f"moved ({moved}) {after.sigma_px:.2g} px."
        )
        found.append(Finding("doubtful", "interface-wrong", text, _CURE))
    return found


def _missing(points: Points, answer: Answer) -> list[Finding]:
    """Whether a surface of water on the way would explain the points much better than the lens alone."""
    if points.n < SETTINGS.fewest or points.coplanar or answer.uncertainty.names[:1] != ("omega_x",):
        return []
    few = points.thinned(SETTINGS.most)
    camera = answer.camera
    nominal = Nominal(camera.Cx, camera.Cy, camera.dx, camera.dy, camera.image_size)
    best: Fit | None = None
    for surface in _surfaces(camera, few):
        try:
            begin = starts(few.p, few.b, nominal._replace(through=(surface,)))
        except (ValueError, np.linalg.LinAlgError):
            continue
        if not begin:
            continue
        near = min(begin, key=lambda start: float(np.median(distances(start, few.p, few.b))))
        fit = fit_camera(few.p, few.b, nominal, model="tsai2", sd=few.sd, survey=few.survey, near=near, tolerance=1e-4)
        if fit and (best is None or fit.cost < best.cost):
            best = fit
    if best is None or not _better(answer.fit, best, few.n):
        return []
    surface = best.camera.through[0]
    normal = ", ".join(f"{each:.2g}" for each in surface.normal)
    text = (
        f"the points look as seen through water: with a surface of water between them and the camera (normal "
        f"[{normal}]) they leave {best.sigma_px:.2g} px, with the lens alone {answer.fit.sigma_px:.2g} px."
    )
    cure = "If the camera looks through a window or into water, describe it under interfaces and name it in through."
    return [Finding("doubtful", "interface-missing", text, cure)]


_CURE = (
    "Measure the interface again, or correct its point, normal, thickness, indices or sigma under interfaces in "
    "config.yaml."
)


def _kind(name: str) -> str:
    return name.rsplit(".", 1)[1].replace("_", " ")


def _amount(name: str, value: float, units: str) -> str:
    kind = _kind(name)
    if kind.startswith("tilt"):
        return f"{np.degrees(value):+.2g} deg"
    return f"{value:+.2g}" if kind.startswith("index") else f"{value:+.3g} {units}"


def _depth(camera: Camera, points: Points) -> float:
    return float(np.linalg.norm(points.p.mean(0) - camera.position))


def _loose(interface: Interface, depth: float) -> Interface:
    """The interface with its place, attitude and last index hardly known."""
    last = interface.parameters[-1]
    wide = {"position": SETTINGS.loose_position * depth, "tilt": SETTINGS.loose_tilt}
    sigma = [
        SETTINGS.loose_index if name == last else wide.get(_kind(name).split()[0], 0.0) for name in interface.parameters
    ]
    return replace(interface, sigma=tuple(sigma), known=None)


def _surfaces(camera: Camera, points: Points) -> Sequence[Interface]:
    """Surfaces of water that may lie before the points: at right angles to the view, and along the world's axes."""
    middle = points.p.mean(0)
    ahead = middle - camera.position
    depth = float(np.linalg.norm(ahead))
    ahead = ahead / depth
    found = []
    for normal in [ahead, *(axis for axis in np.eye(3) if abs(axis @ ahead) > 0.5)]:
        normal = normal * np.sign(normal @ ahead)
        nearest = float(((points.p - middle) @ normal).min())
        reach = float((middle - camera.position) @ normal) + nearest
        point = middle + normal * (nearest - 0.3 * max(reach, 0.0))
        sigma = (SETTINGS.loose_position * depth, SETTINGS.loose_tilt, SETTINGS.loose_tilt, 0.0)
        found.append(Interface("water", point, normal, WATER, (), sigma))
    return found


def _better(before: Fit, after: Fit, n: int) -> bool:
    """Whether a fit explains n points so much better that it is no chance."""
    if not (np.isfinite(after.sigma_px) and after.sigma_px > 0 and np.isfinite(before.sigma_px)):
        return False
    ratio = before.sigma_px / after.sigma_px
    return bool(ratio > 1 / SETTINGS.share and 2 * n * np.log(ratio) > SETTINGS.nats)


def _expected(stated: Points, answer: Answer) -> float:
    """The noise of one coordinate, px, that stated noise and survey make."""
    C = covariances(answer.camera, stated.p, stated.sd, stated.survey)
    return float(np.sqrt(np.median((C[:, 0, 0] + C[:, 1, 1]) / 2)))


def _explained(stated: Points, answer: Answer) -> bool:
    """Whether the fit leaves no more than the stated noise, or than centroids have as a rule."""
    expected = SETTINGS.usual_px if stated.sd is None else _expected(stated, answer)
    return answer.fit.sigma_px < SETTINGS.explained * expected


def unexplained(stated: Points, answer: Answer, units: str) -> Finding | None:
    """Whether the residuals are as large as the stated noise of centroids and survey."""
    if stated.sd is None:
        return None
    expected = _expected(stated, answer)
    centroids = float(np.sqrt(np.median((stated.sd**2).mean(1))))
    B = derivatives(answer.camera, stated.p, stated.p.mean(0)).by_point
    px_per_unit = float(np.sqrt(np.nanmedian((B**2).sum((1, 2)) / 2)))
    sigma = 0.0 if stated.survey is None else float(np.median(stated.survey))
    survey_px = float(np.sqrt(max(expected**2 - centroids**2, 0.0)))
    return misfit(answer.fit.sigma_px, expected, survey_px, 1 / px_per_unit, sigma, units)

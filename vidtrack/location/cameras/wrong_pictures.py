"""Whether a camera that fits no other would fit if its pictures were mirrored, turned, or another camera's.

Each such mistake is tried on the tracks that are there: the camera's pixels are mirrored or turned, or two cameras
exchange their recordings, and the tracks of every pair of cameras are compared with each other's epipolar lines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.assignment import one_to_one
from vidtrack.findings import Finding
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.location.cameras.same_film import same_film
from vidtrack.location.cameras.views import Seen, View


@dataclass(frozen=True)
class Trial:
    """How mistakes are tried.

    moments    evenly spread, at which tracks are compared
    tracks     of a camera, those with the most samples
    fewest     moments that two tracks must share
    better     times by which a mistake must fit better than the pictures as they are
    """

    moments: int = 150
    tracks: int = 8
    fewest: int = 10
    better: float = 4.0


TRIAL = Trial()


class Mistake(NamedTuple):
    """A mistake that explains the misfit: what it is, of which cameras, and distances before and with it, px rms."""

    kind: str  # mirrored | upside down | turned | exchanged
    cameras: tuple[int, ...]
    before_px: float
    with_px: float


def wrong_pictures(views: Sequence[View], seen: Sequence[Seen], tolerance_px: float, matched: bool) -> list[Finding]:
    """What to say of a run whose cameras do not fit together; matched: some of them do."""
    if copies := same_film(views, matched and len(views) > 2):
        return copies
    found = mistake([v.camera for v in views], [s.b for s in seen], tolerance_px)
    if found is None:
        return []
    suffice = matched and len(views) - len(found.cameras) >= 2
    return [finding_of(found, [v.name for v in views], others_suffice=suffice)]


def mistake(cameras: Sequence[Camera], seen: Sequence[Array], tolerance_px: float) -> Mistake | None:
    """The one mistake with which the cameras fit; None where they fit as they are, or where none or several help.

    seen   for each camera (n_tracks, M, 2) px at M common moments, NaN where nothing was measured
    """
    tracks = [_longest(own) for own in seen]
    before = _misfit(cameras, tracks)
    fits = []
    for kind, who, own_cameras, own_tracks in _mistakes(list(cameras), tracks):
        misfit = _misfit(own_cameras, own_tracks)
        if misfit < tolerance_px and misfit * TRIAL.better < before:
            fits.append(Mistake(kind, who, before, misfit))
    fits.sort(key=lambda fit: fit.with_px)
    if not fits or (len(fits) > 1 and fits[1].with_px < 2 * fits[0].with_px):
        return None
    return fits[0]


def finding_of(found: Mistake, names: Sequence[str], *, others_suffice: bool) -> Finding:
    """What the user reads of a mistake."""
    who = " and ".join(names[i] for i in found.cameras)
    gain = f"so taken, tracks lie {found.with_px:.2g} px rms off each other's epipolar lines, not {found.before_px:.3g}"
    if found.kind == "exchanged":
        text = f"{who}: their recordings, or their calibration clips, seem to be exchanged: {gain}"
        cure = "Exchange the files in the run's folder, or those in the folders of the calibration clips."
    else:
        whose = "its" if len(found.cameras) == 1 else "their"
        text = f"{who}: {whose} pictures seem to be {found.kind}, compared with {whose} calibration: {gain}"
        cure = "Record run and calibration alike, or turn one of them; players may hide it: a flag in the file does."
    return Finding("doubtful" if others_suffice else "bad", "pictures-wrong", text, cure)


def _mistakes(
    cameras: list[Camera], tracks: list[Array]
) -> Iterator[tuple[str, tuple[int, ...], list[Camera], list[Array]]]:
    for i, camera in enumerate(cameras):
        for kind, turned in _TURNED.items():
            changed = list(tracks)
            changed[i] = turned(tracks[i], np.array(camera.image_size, float) - 1)
            yield kind, (i,), cameras, changed
    for kind, turned in _TURNED.items():  # of all cameras alike, as one program or one habit makes them
        changed = [turned(b, np.array(own.image_size, float) - 1) for b, own in zip(tracks, cameras, strict=True)]
        yield kind, tuple(range(len(cameras))), cameras, changed
    for i, j in combinations(range(len(cameras)), 2):
        changed = list(tracks)
        changed[i], changed[j] = tracks[j], tracks[i]
        yield "exchanged", (i, j), cameras, changed


_TURNED: dict[str, Callable[[Array, Array], Array]] = {
    "mirrored left to right": lambda b, last: np.stack([last[0] - b[..., 0], b[..., 1]], -1),
    "upside down and mirrored": lambda b, last: np.stack([b[..., 0], last[1] - b[..., 1]], -1),
    "turned by 180 degrees": lambda b, last: last - b,
}


def _longest(b: Array) -> Array:
    """The tracks with the most samples, at moments evenly spread."""
    known = np.isfinite(b[..., 0])
    order = np.argsort(-known.sum(1), kind="stable")[: TRIAL.tracks]
    moments = np.linspace(0, b.shape[1] - 1, min(b.shape[1], TRIAL.moments)).round().astype(int)
    return b[order][:, moments]


def _misfit(cameras: Sequence[Camera], tracks: Sequence[Array]) -> float:
    """The worst pair of cameras: px rms, the median over its pairs of tracks that go best together; inf where no tracks
    share moments.
    """
    worst = 0.0
    for i, j in combinations(range(len(cameras)), 2):
        there, back = (
            epipolar_distance(cameras[a], cameras[b], tracks[a][:, None], tracks[b][None]) for a, b in ((i, j), (j, i))
        )
        square = np.maximum(there**2, np.swapaxes(back, 0, 1) ** 2)
        known = np.isfinite(square)
        count = known.sum(-1)
        mean = np.where(known, square, 0.0).sum(-1) / np.maximum(count, 1)
        chosen = one_to_one(np.where(count >= TRIAL.fewest, mean, np.inf))
        own = np.flatnonzero(chosen >= 0)
        if not own.size:
            return float("inf")
        worst = max(worst, float(np.sqrt(np.median(mean[own, chosen[own]]))))
    return worst

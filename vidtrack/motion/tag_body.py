"""A body that carries coded tags, over time: its poses, its columns in tables, and what is to be said of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.findings import Finding
from vidtrack.motion.pose_columns import pose_columns
from vidtrack.motion.scale import Scale
from vidtrack.motion.sighted_pose import SightedPose, by_pose_of


@dataclass(frozen=True)
class Limits:
    """From when something is said of a pose.

    misfit      reduced chi squared, over that of the whole run, from which a sample's corners are misplaced
    rough       reduced chi squared of the whole run from which calibration, size or places are in doubt
    size_sure   standard errors, and size_share of the side, by which a tag's size must differ to be called wrong
    ambiguous   share of the samples from which ambiguity is a finding; the same of those that are missing
    """

    misfit: float = 9.0
    rough: float = 25.0
    size_sure: float = 5.0
    size_share: float = 0.005
    size_bad: float = 0.02
    ambiguous: float = 0.05


LIMITS = Limits()


class TagPose(NamedTuple):
    """A body's poses at T times, with all that adds to their covariance."""

    name: str
    tags: tuple[int, ...]
    body: Array  # (n, 3) the corners in the body's axes
    pose: SightedPose
    covariance: Array  # (T, 6, 6)
    factor: float  # by which the corners' variances were grown to explain the misfit
    n_points: NDArray[np.intp]  # (T,)
    n_cameras: NDArray[np.intp]  # (T,)
    flag: list[str]  # (T,)
    scale: Scale | None


def record_of(poses: Sequence[TagPose]) -> dict[str, Any]:
    out = {}
    for own in poses:
        n = len(own.flag)
        words = [word for flag in own.flag for word in flag.split(";") if word]
        out[own.name] = {
            "tags": list(own.tags),
            "samples": n,
            "located": int(np.isfinite(own.pose.origin[:, 0]).sum()),
            "one_camera": float((own.n_cameras == 1).mean()) if n else 0.0,
            "flags": {word: words.count(word) / n for word in dict.fromkeys(words)},
            "rms_px": float(np.sqrt(np.nanmean(own.pose.rms_px**2))) if np.isfinite(own.pose.rms_px).any() else None,
            "sd_grown": float(np.sqrt(own.factor)),
            "size": own.scale.as_record() if own.scale else None,
        }
    return out


def findings_of(own: TagPose, size: float, where: str) -> list[Finding]:
    found = []
    n = max(len(own.flag), 1)
    shares = {word: sum(word in flag.split(";") for flag in own.flag) / n for word in ("ambiguous", "misfit")}
    wrong = own.scale.off(LIMITS.size_sure, LIMITS.size_share) if own.scale else None
    if shares["ambiguous"] > LIMITS.ambiguous and wrong is None:
        text = (
            f"{where}: body {own.name}: in {100 * shares['ambiguous']:.0f} % of the samples two poses explain "
            "the picture: neither is given there"
        )
        cure = (
            "Film the tag from a shorter distance or turned by at least 20 degrees, put a second tag on another face, "
            "or add a camera."
        )
        level = "bad" if shares["ambiguous"] > 0.5 else "doubtful"
        found.append(Finding(level, "tag-ambiguous", text, cure))  # type: ignore[arg-type]
    if wrong is not None:
        text = (
            f"{where}: body {own.name}: its tags measure {size * wrong:.4g} along a side, not {size:.4g} as "
            "tags.size says"
        )
        level = "bad" if abs(wrong - 1) > LIMITS.size_bad else "doubtful"
        cure = "Measure the black square from edge to edge, without its white margin."
        found.append(Finding(level, "tag-size", text, cure))  # type: ignore[arg-type]
    elif own.factor > LIMITS.rough or shares["misfit"] > LIMITS.ambiguous:
        text = (
            f"{where}: body {own.name}: the corners lie {np.sqrt(own.factor):.2g} times farther from where the pose "
            "puts them than they are measured to"
        )
        cure = "Are the places of the tags in bodies right, the tags flat, and is it the lens of the calibration?"
        found.append(Finding("doubtful", "tag-misfit", text, cure))
    return found


def body_columns(own: TagPose, at: Array, timecode: NDArray[np.object_]) -> dict[str, Any]:
    """The poses at the moments `at` as columns of bodies.parquet, and n_cameras."""
    rms = own.pose.rms_px * own.pose.per_px
    p = own.pose
    columns = pose_columns(own.name, at, timecode, p.origin, p.R, own.covariance, rms, own.n_points, own.flag)
    return columns | {"n_cameras": own.n_cameras}


def tag_columns(own: TagPose, at: Array, timecode: NDArray[np.object_], *, corners: bool) -> Iterator[dict[str, Any]]:
    """Where the centre of each tag was, target tag7, as columns of trajectories.parquet.

    corners   its corners tag7_1 to tag7_4 too
    """
    for k, number in enumerate(own.tags):
        places = own.body[4 * k : 4 * k + 4]
        named = {f"tag{number}": places.mean(0)}
        named |= {f"tag{number}_{i + 1}": place for i, place in enumerate(places)} if corners else {}
        for target, place in named.items():
            arm = own.pose.R @ place
            J = by_pose_of(np.eye(3)[None], arm)
            p = own.pose.origin + arm
            with np.errstate(invalid="ignore"):
                sigma = np.sqrt(np.diagonal(J @ own.covariance @ np.swapaxes(J, -1, -2), axis1=1, axis2=2))
            columns = {"time_s": at, "timecode": timecode, "target": target}
            columns |= {axis: p[:, i] for i, axis in enumerate("xyz")}
            columns |= {f"sigma_{axis}": sigma[:, i] for i, axis in enumerate("xyz")}
            columns |= {"miss": own.pose.rms_px * own.pose.per_px, "n_cameras": own.n_cameras}
            yield columns | {"flag": ["lost" if word == "missing" else word for word in own.flag]}

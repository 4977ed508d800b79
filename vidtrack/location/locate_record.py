"""The record of a located run: clocks, correspondence, noise, lines of sight, samples, volume."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vidtrack.arrays import Array, Ints
from vidtrack.association.associate import NONE
from vidtrack.association.mirror import images_among
from vidtrack.geometry.triangulate import Located
from vidtrack.location.cameras.views import View, of_samples
from vidtrack.location.clocks.run_clocks import RunClocks
from vidtrack.location.matching import Match
from vidtrack.location.sight_lines.centroid_noise import Noise
from vidtrack.location.sight_lines.sight_misses import Misses
from vidtrack.timing.agreement import Timing
from vidtrack.timing.clock import Clock

LARGEST_LEAD = float(np.log(1e12))
"""Nats beyond which odds are as good as certain."""


def clock_record(views: Sequence[View], given: Sequence[Clock | str], timed: RunClocks) -> dict[str, Any]:
    """Each camera's clock, the method that gives it and what each method says; the error curve of the motion."""
    cameras: dict[str, Any] = {}
    motion = timed.motion
    for i, view in enumerate(views):
        clock, sd = timed.clocks[i], Timing(timed.clocks[i], timed.covariance[i]).sd
        own: dict[str, Any] = {"offset_s": clock.offset_s, "rate_ppm": clock.rate_ppm, "source": "config"}
        if isinstance(given[i], str):
            first = not np.any(timed.covariance[i])
            own |= {"source": "reference" if first else " and ".join(timed.used[i]) or "none"}
            own |= {"offset_s_sd": sd.offset_s, "rate_ppm_sd": sd.rate_ppm}
            own |= {"offset_s_95": [clock.offset_s - 1.96 * sd.offset_s, clock.offset_s + 1.96 * sd.offset_s]}
            own |= {"rate_ppm_95": [clock.rate_ppm - 1.96 * sd.rate_ppm, clock.rate_ppm + 1.96 * sd.rate_ppm]}
            own |= {"ambiguous": motion is not None and "motion" in timed.used[i] and motion.ambiguous[i]}
            own |= {"witnesses": {w: _said(t, w in timed.used[i]) for w, t in timed.estimates[i].items()}}
        if motion is not None and np.isfinite(motion.error_by_offset[i]).any():
            tried = (motion.offsets + motion.clocks[i].offset_s).tolist()
            own |= {"offsets_s": tried, "error_px": motion.error_by_offset[i].tolist()}
        cameras[view.name] = own
    record: dict[str, Any] = {"cameras": cameras}
    if motion is not None:
        record |= {"error_px": motion.error_px, "error_before_px": timed.error_before_px}
    return record


def _said(timing: Timing, used: bool) -> dict[str, Any]:
    return {
        "offset_s": timing.clock.offset_s,
        "offset_s_sd": timing.sd.offset_s,
        "rate_ppm": timing.clock.rate_ppm,
        "rate_ppm_sd": timing.sd.rate_ppm,
        "used": used,
    }


def match_record(
    views: Sequence[View], match: Match, located: Located, at: Array, tolerance_px: float
) -> dict[str, Any]:
    """Which tracks make each target, how well they fit, in px and in world units, how surely, and what is left over."""
    scale = _world_per_px(views, located)
    targets = {}
    whose = [of_samples(v.piece, t) for v, t in zip(views, match.trajectory, strict=True)]
    for k, label in enumerate(match.labels):
        lead = float(match.lead[k])
        targets[label] = {
            "tracks": {
                v.name: [v.tracks[i] for i in np.flatnonzero((own == k).any(1)) if v.tracks[i]]
                for v, own in zip(views, whose, strict=True)
            },
            "error_px": float(match.error_px[k]),
            "error": float(match.error_px[k]) * scale,
            "odds": odds_of(lead) if np.isfinite(lead) else None,
            "part_of": [match.labels[other] for other in (match.part_of[k] if match.part_of else ())],
            "ambiguous": any(
                ((reason[v.piece] == "contested") & (v.piece != NONE))[(own == k).any(1)].any()
                for v, own, reason in zip(views, whose, match.reason, strict=True)
                if reason.size
            ),
            "moments": int(match.n_common[k]),
            **_span(located.point[k], at),
        }
    return {
        "tolerance_px": tolerance_px,
        "tolerance": tolerance_px * scale,
        "world_per_px": scale,
        "bias_px": match.bias_px if np.isfinite(match.bias_px) else None,
        "targets": targets,
        "besides": [
            {
                "reason": own.reason,
                "of": match.labels[own.of] if own.of != NONE else "",
                "start_s": float(at[own.first]),
                "end_s": float(at[own.last]),
                "samples": own.n,
                "place": own.place.tolist(),
            }
            for own in match.left
        ],
        "mirrored": _mirrored(views, match.labels, located),
        "unmatched": {v.name: own for v, own in zip(views, _unmatched(views, whose), strict=True) if own},
        "left_over": {v.name: own for v, own in zip(views, _left_over(views, match), strict=True) if own},
    }


def odds_of(lead: float) -> float:
    """How many times likelier a choice is than the next one that is so many nats less likely."""
    return float(np.exp(min(lead, LARGEST_LEAD)))


def _mirrored(views: Sequence[View], labels: Sequence[str], located: Located) -> dict[str, str]:
    """Targets that are mirror images, by their names, each with that which it is the image of."""
    moments = [np.flatnonzero(found) for found in np.isfinite(located.point[..., 0])]
    places = [p[m] for p, m in zip(located.point, moments, strict=True)]
    images = images_among(moments, places, np.array([v.camera.position for v in views]))
    return {labels[i]: labels[j] for i, j in images.items()}


def _span(point: Array, at: Array) -> dict[str, float | None]:
    """When a target (M, 3) is located first and last, s."""
    found = at[np.isfinite(point[:, 0])]
    return {"start_s": float(found[0]) if found.size else None, "end_s": float(found[-1]) if found.size else None}


def _unmatched(views: Sequence[View], whose: Sequence[Ints]) -> list[list[str]]:
    """Tracks of each camera none of whose samples is of a target, though they have some."""
    return [
        [v.tracks[i] for i in np.flatnonzero((own == NONE).all(1) & (v.piece != NONE).any(1)) if v.tracks[i]]
        for v, own in zip(views, whose, strict=True)
    ]


def _left_over(views: Sequence[View], match: Match) -> list[list[dict[str, Any]]]:
    """Tracklets of each camera's targets that belong to no trajectory: from when to when, and why."""
    out = []
    for view, trajectory, reason in zip(views, match.trajectory, match.reason, strict=True):
        own = []
        for piece in np.flatnonzero(trajectory == NONE):
            track, sample = np.nonzero(view.piece == piece)
            if not view.tracks[int(track[0])]:
                continue
            span = {"start_s": float(view.t[sample.min()]), "end_s": float(view.t[sample.max()])}
            own.append({"track": view.tracks[int(track[0])], **span, "samples": track.size, "reason": reason[piece]})
        out.append(own)
    return out


def _world_per_px(views: Sequence[View], located: Located) -> float:
    """World units that one px spans where the targets are, median over cameras and samples."""
    p = located.point.reshape(-1, 3)
    p = p[np.isfinite(p[:, 0])][:: max(1, len(p) // 1000)]
    if not len(p):
        return float("nan")
    depths = [p @ v.camera.R[2] + v.camera.T[2] for v in views]
    return float(np.median([d * v.camera.dy / v.camera.f for d, v in zip(depths, views, strict=True)]))


SOURCES = {"differences": "reprojection", "errors": "reprojection errors of few samples", "none": "assumed"}


def noise_record(views: Sequence[View], located: Located, sd: Array, noise: Noise) -> dict[str, Any]:
    """The centroids' noise as used, px, and the reprojection errors, of each camera."""
    used = np.isfinite(located.error) & np.isfinite(located.point[..., :1]) & ~located.left_out[..., None]
    errors = [e[u] for e, u in zip(located.error, used, strict=True)]
    return {
        "sd_px": {v.name: _median(s[u]) for v, s, u in zip(views, sd, used, strict=True)},
        "factor": float(np.median(noise.whole)),
        "source": _source(views, noise),
        "reprojection_rms_px": {
            v.name: float(np.sqrt(np.mean(e**2))) if e.size else None for v, e in zip(views, errors, strict=True)
        },
    }


def _source(views: Sequence[View], noise: Noise) -> str:
    if all(v.has_sd for v in views):
        return "tracker" if noise.source == "none" else "tracker, scaled by the reprojection errors"
    return SOURCES[noise.source]


def sight_line_record(views: Sequence[View], misses: Misses | None) -> dict[str, Any] | None:
    """How far lines of sight miss the points, px rms of each camera, beside what is expected; the likeliest cause."""
    if misses is None:
        return None
    names = [v.name for v in views]
    cause = misses.cause
    return {
        "samples": misses.n,
        "px": dict(zip(names, misses.px.tolist(), strict=True)),
        "expected_px": dict(zip(names, misses.expected_px.tolist(), strict=True)),
        "over_sigma": misses.beyond,
        "late_s": dict(zip(names, misses.late[:, 0].tolist(), strict=True)),
        "late_sd_s": dict(zip(names, misses.late[:, 1].tolist(), strict=True)),
        "speed_px_s": misses.speed,
        "readout_s": dict(zip(names, misses.readout[:, 0].tolist(), strict=True)),
        "readout_sd_s": dict(zip(names, misses.readout[:, 1].tolist(), strict=True)),
        "cause": {
            "kind": cause.kind,
            "cameras": [names[i] for i in cause.cameras],
            "amount": cause.amount,
            "sd": cause.sd,
            "units": {"turned": "deg", "late": "s", "fast": "ppm", "jumped": "s"}.get(cause.kind, "share of f"),
            "share": cause.share,
            "evidence": cause.evidence,
            "moves_over_sigma": cause.moved,
            "from_s": cause.from_s,
        },
    }


def sample_record(views: Sequence[View], located: Located, at: Array) -> dict[str, Any]:
    """How many samples were located, by how many cameras, how well; and those that were not; at (M,) s.

    left_out_where  of each camera that was left out: px by which it misses the others' positions there (median), and
                    the first and the last moment
    """
    found = np.isfinite(located.point[..., 0])
    counts = np.bincount(located.n_cameras.ravel(), minlength=1)
    return {
        "n": found.size,
        "located": int(found.sum()),
        "by_n_cameras": {str(n): int(count) for n, count in enumerate(counts) if count},
        "left_out": {v.name: int(out.sum()) for v, out in zip(views, located.left_out, strict=True)},
        "left_out_where": {
            v.name: {"px": float(np.median(np.linalg.norm(error[out], axis=-1))), "from_s": when[0], "to_s": when[-1]}
            for v, out, error in zip(views, located.left_out, located.error, strict=True)
            if len(when := at[out.any(0)].tolist())
        },
        "disagree": int(located.disagree.sum()),
        "mean_miss": float(located.miss[found].mean()) if found.any() else None,
        "mean_miss_where_disagreed": float(located.miss[located.disagree].mean()) if located.disagree.any() else None,
        "mean_sigma": located.sigma[found].mean(0).tolist() if found.any() else None,
    }


def _median(x: Array) -> float | None:
    return float(np.median(x)) if x.size else None


def volume_record(outside: Array | None, units: str) -> dict[str, Any] | None:
    """The share of samples outside the calibrated volume, and the farthest of them; None where that is not known."""
    if outside is None or not np.isfinite(outside).any():
        return None
    known = outside[np.isfinite(outside)]
    return {"share_outside": float((known > 0).mean()), "farthest_outside": float(known.max()), "units": units}

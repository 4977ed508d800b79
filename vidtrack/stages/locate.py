"""Stage locate, mode space: what several cameras saw becomes trajectories in the world, with time and uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from vidtrack.batch import CameraUncertainty
from vidtrack.camera import Array, Camera
from vidtrack.clock import Clock, Clocks, estimate_clocks
from vidtrack.correspondence import NONE, Correspondence, Indices, by_target, match_errors, match_tracks
from vidtrack.errors import VidtrackError
from vidtrack.resample import common_times, interval, resample
from vidtrack.shared_survey import Survey, joint_covariance
from vidtrack.triangulate import Located, locate_points
from vidtrack.volume import distance_outside

Known = tuple[Camera, CameraUncertainty | None]


class Locations(NamedTuple):
    """What `locate` returns."""

    trajectories: pd.DataFrame
    record: dict[str, Any]


class _View(NamedTuple):
    """One camera's centroid table as arrays: n tracks at T moments."""

    name: str
    camera: Camera
    uncertainty: CameraUncertainty | None
    t: Array  # (T,) s, by the camera's own clock
    timecode: NDArray[np.object_]  # (T,)
    tracks: list[str]
    b: Array  # (n, T, 2) px
    sd: Array  # (n, T, 2) px; 1 where nobody knows
    flag: NDArray[np.object_]  # (n, T)
    has_sd: bool


def locate(
    centroids: Mapping[str, pd.DataFrame],
    cameras: Mapping[str, Any],
    *,
    targets: int | Sequence[str] | None = None,
    clocks: Mapping[str, Mapping[str, float] | Literal["auto"]] | Literal["auto"] | None = None,
    tolerance_px: float = 3.0,
    max_miss: float | None = None,
    points: Mapping[str, pd.DataFrame] | None = None,
    volume: ArrayLike | None = None,
    units: str = "in",
    where: str = "locate",
) -> Locations:
    """Locate every target of a run at every moment at which two cameras or more saw it.

    centroids      camera: table of time_s, target, Xf, Yf (px), flag; timecode, sd_x, sd_y (px) where there are any
    cameras        camera: (Camera, Uncertainty or None), or a Calibrated; more cameras than tables do no harm
    targets        their names, or how many there are; None: as many as the cameras agree upon
    clocks         camera: {"offset_s", "rate_ppm"}, added to its time, or "auto": estimated from the motion
    tolerance_px   how far from its epipolar line a match may lie, and how far from the located point a sample
    max_miss       world units; a fix whose lines of sight miss it by more is not believed
    points         camera: points.parquet, for the calibrated volume and what the calibrations have in common
    volume         (n, 3) calibration points, where `points` is not given
    A moment without a fix is a row of NaN whose flag says why: lost (fewer than two cameras saw the target),
    disagree (they do not see one point), far (max_miss), or what the tracker said, as cam1:edge.
    Raises VidtrackError for fewer than two calibrated cameras or cameras that share no moment.
    """
    views = _views(centroids, cameras, where)
    given = _given_clocks(views, clocks)
    offsets = _whole_days(views)
    warnings: list[str] = []
    names = list(targets) if targets is not None and not isinstance(targets, int) else None
    limit = len(names) if names is not None else targets if isinstance(targets, int) else None

    free = _free(given)
    start = [Clock() if c == "auto" else c for c in given]
    estimated: Clocks | None = None
    if free:
        loose = tolerance_px + _slip_px(views)
        match, _ = _matched(views, _at_common(views, start, offsets), names, limit, loose, [])
        estimated = _estimated(views, start, offsets, free, match, warnings)
        start = list(estimated.clocks)
    times = [_times(view, clock, offset) for view, clock, offset in zip(views, start, offsets, strict=True)]
    _check_overlap(views, times, where)
    at, whose = common_times(times)
    seen = _at_common(views, start, offsets, (at, whose))
    match, labels = _matched(views, seen, names, limit, tolerance_px, warnings)
    m = len(labels)

    b = np.stack([by_target(s.b, t, m) for s, t in zip(seen, match.target, strict=True)])
    sd = np.stack([by_target(s.sd, t, m) for s, t in zip(seen, match.target, strict=True)])
    noise = _noise(views, b, sd)
    sd = np.where(np.isfinite(sd), sd, 1.0) * noise
    survey = _volume(points, volume)
    uncertainties = [v.uncertainty for v in views]
    located = locate_points(
        [v.camera for v in views],
        b,
        sd=sd,
        uncertainties=uncertainties,
        joint=_joint(views, points, noise),
        reject=tolerance_px,
    )
    flag = _flags(views, seen, match, located, b, max_miss)
    table = _table(at, _timecodes(views, times, at, whose), labels, located, flag, max_miss)
    outside = distance_outside(survey, table[["x", "y", "z"]].to_numpy(float)) if survey is not None else None
    if outside is not None:
        table["outside"] = outside > 0
    record: dict[str, Any] = {"mode": "space", "units": units, "cameras": [v.name for v in views]}
    record["clocks"] = _clock_record(views, given, start, estimated)
    record["correspondence"] = _match_record(views, match, labels, located, tolerance_px)
    record["noise"] = _noise_record(views, located, b, sd, noise)
    record["samples"] = _sample_record(views, table, located)
    record["volume"] = _volume_record(outside, units)
    record["warnings"] = [*warnings, *_warnings(record, views, located, b, sd, units, tolerance_px)]
    return Locations(table, record)


# The centroid tables


def _views(centroids: Mapping[str, pd.DataFrame], cameras: Mapping[str, Any], where: str) -> list[_View]:
    if missing := [name for name in centroids if name not in cameras]:
        raise VidtrackError(
            *(f"{where}: camera {c} has no calibration. Add calibration clips or drop its video." for c in missing)
        )
    if len(centroids) < 2:
        names = ", ".join(centroids) or "no camera"
        raise VidtrackError(
            f"{where}: mode space needs two cameras or more; there is {names}. Add a camera, or use mode: plane."
        )
    return [_view(name, table, cameras[name]) for name, table in centroids.items()]


def _view(name: str, table: pd.DataFrame, known: Any) -> _View:
    time = table["time_s"].to_numpy(float)
    t, column = np.unique(time, return_inverse=True)
    codes, labels = pd.factorize(table["target"].astype(str), sort=False)
    b = np.full((len(labels), t.size, 2), np.nan)
    b[codes, column] = table[["Xf", "Yf"]].to_numpy(float)
    sd = np.ones(b.shape)
    has_sd = {"sd_x", "sd_y"} <= set(table.columns) and bool(np.isfinite(table["sd_x"]).any())
    if has_sd:
        own = table[["sd_x", "sd_y"]].to_numpy(float)
        usual = np.nanmedian(own, axis=0)
        sd[codes, column] = np.where(np.isfinite(own) & (own > 0), own, usual)
    flag = np.full(b.shape[:2], "", object)
    if "flag" in table:
        flag[codes, column] = table["flag"].fillna("").astype(str)
    timecode = np.full(t.size, "", object)
    if "timecode" in table:
        timecode[column] = table["timecode"].fillna("").astype(str)
    return _View(name, known[0], known[1], t, timecode, [str(x) for x in labels], b, sd, flag, has_sd)


def _whole_days(views: Sequence[_View]) -> list[float]:
    """Days, s, by which a camera whose time code passed midnight is brought to the first one's day."""
    first = [float(v.t[0]) if v.t.size else 0.0 for v in views]
    return [86400.0 * round((first[0] - f) / 86400.0) for f in first]


def _times(view: _View, clock: Clock, offset: float) -> Array:
    return clock.corrected(view.t) + offset


class _Seen(NamedTuple):
    """A camera's tracks at the common moments."""

    b: Array  # (n, M, 2)
    sd: Array
    flag: NDArray[np.object_]  # (n, M)


def _at_common(
    views: Sequence[_View],
    clocks: Sequence[Clock],
    offsets: Sequence[float],
    common: tuple[Array, NDArray[np.intp]] | None = None,
) -> list[_Seen]:
    times = [_times(view, clock, offset) for view, clock, offset in zip(views, clocks, offsets, strict=True)]
    at, _ = common_times(times) if common is None else common
    out = []
    for view, t in zip(views, times, strict=True):
        brought = resample(t, view.b, at)
        out.append(_Seen(brought.values, *_carried(view, brought.gain, brought.before, brought.after)))
    return out


def _carried(
    view: _View, gain: Array, before: NDArray[np.intp], after: NDArray[np.intp]
) -> tuple[Array, NDArray[np.object_]]:
    """Standard deviations of samples brought to common moments, and the flags of the samples on either side."""
    if not view.t.size:
        return np.full((*gain.shape, 2), np.nan), np.full(gain.shape, "", object)
    left, right = np.clip(before, 0, view.t.size - 1), np.clip(after, 0, view.t.size - 1)
    sd = np.maximum(view.sd[:, left], view.sd[:, right]) * gain[..., None]
    a, b = view.flag[:, left], view.flag[:, right]
    flag = np.where(a == b, a, _both(a, b))
    flag[:, (before < 0) | (after >= view.t.size)] = ""
    return sd, flag


def _both(a: NDArray[np.object_], b: NDArray[np.object_]) -> NDArray[np.object_]:
    return np.asarray(np.where(a == "", b, np.where(b == "", a, a + ";" + b)), object)


# Clocks


def _given_clocks(
    views: Sequence[_View], clocks: Mapping[str, Mapping[str, float] | Literal["auto"]] | Literal["auto"] | None
) -> list[Clock | Literal["auto"]]:
    given: list[Clock | Literal["auto"]] = []
    for view in views:
        own = clocks if clocks is None or isinstance(clocks, str) else clocks.get(view.name)
        given.append("auto" if own == "auto" else Clock(**own) if isinstance(own, Mapping) else Clock())
    return given


def _free(given: Sequence[Clock | Literal["auto"]]) -> list[int]:
    """Cameras whose clock is sought; where all are, the first one tells the time."""
    auto = [i for i, c in enumerate(given) if c == "auto"]
    return auto if len(auto) < len(given) else auto[1:]


def _slip_px(views: Sequence[_View]) -> float:
    """How far, px, a target usually moves from sample to sample: what one interval's delay may do."""
    steps = [np.linalg.norm(np.diff(v.b, axis=1), axis=-1).ravel() for v in views if v.t.size > 1]
    moved = np.concatenate([s[np.isfinite(s)] for s in steps]) if steps else np.zeros(0)
    return float(np.percentile(moved, 90)) if moved.size else 0.0


def _estimated(
    views: Sequence[_View],
    start: Sequence[Clock],
    offsets: Sequence[float],
    free: list[int],
    match: Correspondence,
    warnings: list[str],
) -> Clocks:
    m = len(match.error_px)
    estimated = estimate_clocks(
        [v.camera for v in views],
        [v.t + o for v, o in zip(views, offsets, strict=True)],
        [by_target(v.b, t, m) for v, t in zip(views, match.target, strict=True)],
        free=free,
        clocks=start,
        bias_px=_bias_px(views),
    )
    step = min((interval(v.t) for v in views), default=float("nan"))
    for camera in free:
        sd = estimated.sd[camera].offset_s
        if not sd < 0.1 * step:
            warnings.append(
                f"cameras.{views[camera].name}.clock: the motion does not tell it "
                f"(standard error {1e3 * sd:.3g} ms). Move a target across the epipolar lines, or give offset_s."
            )
        if estimated.ambiguous[camera]:
            warnings.append(
                f"cameras.{views[camera].name}.clock: another offset fits about as well as "
                f"{estimated.clocks[camera].offset_s:.4g} s (a periodic motion). Give offset_s to within a period."
            )
    return estimated


def _bias_px(views: Sequence[_View]) -> float:
    """ASSUME: the calibration's share in an epipolar distance is some 0.1 px where its uncertainty is not known."""
    return 0.1 if any(v.uncertainty is None for v in views) else 0.05


def _check_overlap(views: Sequence[_View], times: Sequence[Array], where: str) -> None:
    spans = [(t[0], t[-1]) for t in times if t.size]
    overlap = any(a[0] <= b[1] and b[0] <= a[1] for i, a in enumerate(spans) for b in spans[i + 1 :])
    if not overlap:
        told = ", ".join(
            f"{v.name} {t[0]:.3f} to {t[-1]:.3f} s" if t.size else f"{v.name} nothing"
            for v, t in zip(views, times, strict=True)
        )
        raise VidtrackError(
            f"{where}: no two cameras saw a target at one moment ({told}). "
            "Check the time codes, or give cameras.<name>.clock.offset_s."
        )


# Correspondence


def _matched(
    views: Sequence[_View],
    seen: Sequence[_Seen],
    names: list[str] | None,
    limit: int | None,
    tolerance_px: float,
    warnings: list[str],
) -> tuple[Correspondence, list[str]]:
    """Which tracks are one target, and the targets' names."""
    cameras, tracks = [v.camera for v in views], [s.b for s in seen]
    same = _by_name(views, tracks, names)
    if same is not None and not (same.error_px > tolerance_px).any():
        return same, [n for n in names or [] if any(n in v.tracks for v in views)]
    match = match_tracks(cameras, tracks, tolerance_px=tolerance_px, targets=limit)
    if same is not None:
        if len(match.error_px) < len(same.error_px) or match.ambiguous.any():
            return _only_choice(same, same.error_px, tolerance_px, warnings), list(names or [])
        warnings.append("targets: the names do not agree between cameras; matched along epipolar lines instead.")
    if not len(match.error_px) and all(len(v.tracks) == 1 for v in views):
        # one target in every camera: there is nothing else that it could be
        target = tuple(np.zeros(1, np.intp) for _ in views)
        error = match_errors(cameras, tracks)
        alone = Correspondence(target, error, np.full(1, np.inf), np.zeros(1, bool), np.zeros(1, np.intp), 0)
        return _only_choice(alone, error, tolerance_px, warnings), _labels(views, alone, names)
    return match, _labels(views, match, names)


def _only_choice(match: Correspondence, error: Array, tolerance_px: float, warnings: list[str]) -> Correspondence:
    worst = float(np.nanmax(error, initial=0.0))
    warnings.append(
        f"targets: matched by name or number, but {worst:.3g} px rms off their epipolar lines (tolerance "
        f"{tolerance_px:g} px). Check the calibration and the cameras' clocks."
    )
    return match


def _by_name(views: Sequence[_View], tracks: Sequence[Array], names: list[str] | None) -> Correspondence | None:
    """The correspondence that the names tell, where the user gave them and every track bears one."""
    if names is None or not all(set(v.tracks) <= set(names) for v in views):
        return None
    shown = [n for n in names if any(n in v.tracks for v in views)]
    target = tuple(np.array([shown.index(n) for n in v.tracks], np.intp) for v in views)
    seen = [by_target(b, t, len(shown)) for b, t in zip(tracks, target, strict=True)]
    common = (np.sum([np.isfinite(b[..., 0]) for b in seen], 0) >= 2).sum(-1)
    nobody = np.full(len(shown), np.inf)
    return Correspondence(
        target,
        match_errors([v.camera for v in views], seen),
        nobody,
        np.zeros(len(shown), bool),
        common,
        int(tracks[0].shape[1]),
    )


def _labels(views: Sequence[_View], match: Correspondence, names: list[str] | None) -> list[str]:
    """Each target's name: the user's where a track bears one, else its track's in the first camera that shows it."""
    labels: list[str] = []
    for k in range(len(match.error_px)):
        own = [v.tracks[i] for v, t in zip(views, match.target, strict=True) for i in np.flatnonzero(t == k)]
        wanted = [n for n in own if names is not None and n in names] + own
        free = [n for n in wanted if n not in labels] or [f"t{i}" for i in range(1, k + 2) if f"t{i}" not in labels]
        labels.append(free[0])
    return labels


# Uncertainty


def _noise(views: Sequence[_View], b: Array, sd: Array) -> float:
    """By how much the standard deviations of the centroids are to be multiplied.

    The reprojection errors of one target change from sample to sample by the centroids' noise, while what the
    calibration leaves in them hardly changes: their successive differences show the noise alone. With fewer than
    30 redundant differences the tracker is believed, or 0.1 px where it says nothing.
    """
    fallback = 1.0 if all(v.has_sd for v in views) else 0.1
    if not b.size:
        return fallback
    some = slice(0, 4000)
    sd = np.where(np.isfinite(sd), sd, 1.0)[:, :, some]
    located = locate_points([v.camera for v in views], b[:, :, some], sd=sd)
    used = np.isfinite(located.error[..., 0]) & np.isfinite(located.point[..., 0])
    change = np.diff(located.error, axis=2) / np.sqrt(sd[:, :, 1:] ** 2 + sd[:, :, :-1] ** 2)
    both = (used[:, :, 1:] == used[:, :, :-1]).all(0) & (used[:, :, 1:].sum(0) >= 2)
    spare = np.where(both, 2.0 * used[:, :, 1:].sum(0) - 3, 0)[both]
    chi2 = np.nansum(change**2, (0, -1))[both]
    if spare.sum() < 30:
        return fallback
    variance = float(np.median(chi2 / spare)) / 0.5
    for _ in range(20):  # merged or mistaken samples do not count
        good = chi2 <= (spare + 12 * np.sqrt(2 * spare)) * variance
        variance = float(chi2[good].sum() / spare[good].sum())
    return max(float(np.sqrt(variance)), 1e-6)


def _joint(views: Sequence[_View], points: Mapping[str, pd.DataFrame] | None, noise: float) -> Array | None:
    """What the calibrations have in common, where their points and tolerances are known."""
    if points is None or any(v.uncertainty is None or v.name not in points for v in views):
        return None
    surveys = [_survey(points[v.name], noise) for v in views]
    if all((s.sigma == 0).all() for s in surveys):
        return None
    return joint_covariance([v.camera for v in views], [v.uncertainty for v in views], surveys)


def _survey(points: pd.DataFrame, noise: float) -> Survey:
    used = points[points["used"].astype(bool)] if "used" in points else points
    used = used.drop_duplicates("tag")
    sigma = used["sigma"].fillna(0.0).to_numpy(float) if "sigma" in used else np.zeros(len(used))
    sd = np.nanmedian(used[["sd_x", "sd_y"]].to_numpy(float)) if {"sd_x", "sd_y"} <= set(used) else np.nan
    p = used[["x", "y", "z"]].to_numpy(float)
    return Survey(tuple(used["tag"].astype(str)), p, sigma, float(sd) if np.isfinite(sd) and sd > 0 else noise)


def _volume(points: Mapping[str, pd.DataFrame] | None, volume: ArrayLike | None) -> Array | None:
    if volume is not None:
        return np.asarray(volume, float)
    if not points:
        return None
    used = [t[t["used"].astype(bool)] if "used" in t else t for t in points.values()]
    return np.concatenate([t[["x", "y", "z"]].to_numpy(float) for t in used])


# The tables


def _flags(
    views: Sequence[_View],
    seen: Sequence[_Seen],
    match: Correspondence,
    located: Located,
    b: Array,
    max_miss: float | None,
) -> NDArray[np.object_]:
    """What is to be said of every sample (m, M): the fix first, then camera by camera."""
    flag = np.full(located.point.shape[:-1], "", object)
    lost = np.isnan(located.point[..., 0])
    few = np.isfinite(b[..., 0]).sum(0) < 2
    flag[lost & few] = "lost"
    flag[lost & ~few] = "no_fix"
    flag[located.disagree] = "disagree"
    if max_miss is not None:
        flag[~lost & (located.miss > max_miss)] = "far"
    for i, (view, s) in enumerate(zip(views, seen, strict=True)):
        own = _flag_by_target(s.flag, match.target[i], flag.shape)
        own[located.left_out[i]] = _both(own, np.full(own.shape, "left_out", object))[located.left_out[i]]
        said = own != ""
        told = np.array([";".join(f"{view.name}:{part}" for part in dict.fromkeys(x.split(";"))) for x in own[said]])
        flag[said] = _both(flag[said], told.astype(object))
    return flag


def _flag_by_target(flag: NDArray[np.object_], target: Indices, shape: tuple[int, ...]) -> NDArray[np.object_]:
    out = np.full(shape, "", object)
    for track in np.flatnonzero(target != NONE):
        out[target[track]] = _both(out[target[track]], flag[track])
    return out


def _timecodes(
    views: Sequence[_View], times: Sequence[Array], at: Array, whose: NDArray[np.intp]
) -> NDArray[np.object_]:
    """The label of every common moment, by the camera whose moment it is."""
    out = np.full(at.size, "", object)
    for i, (view, t) in enumerate(zip(views, times, strict=True)):
        own = whose == i
        out[own] = view.timecode[np.searchsorted(t, at[own])]
    return out


def _table(
    at: Array,
    timecode: NDArray[np.object_],
    labels: Sequence[str],
    located: Located,
    flag: NDArray[np.object_],
    max_miss: float | None,
) -> pd.DataFrame:
    m, M = len(labels), at.size
    point, sigma, n = located.point.reshape(-1, 3), located.sigma.reshape(-1, 3), located.n_cameras.ravel()
    miss = located.miss.ravel()
    if max_miss is not None:
        far = miss > max_miss
        point, sigma = np.where(far[:, None], np.nan, point), np.where(far[:, None], np.nan, sigma)
        n = np.where(far, 0, n)
    columns: dict[str, Any] = {
        "time_s": np.tile(at, m),
        "timecode": np.tile(timecode, m),
        "target": np.repeat(np.array(labels, object), M),
    }
    columns |= {a: point[:, k] for k, a in enumerate("xyz")}
    columns |= {f"sigma_{a}": sigma[:, k] for k, a in enumerate("xyz")}
    columns |= {"miss": miss, "n_cameras": n.astype(np.int64), "flag": flag.ravel()}
    return pd.DataFrame(columns)


def _clock_record(
    views: Sequence[_View],
    given: Sequence[Clock | Literal["auto"]],
    used: Sequence[Clock],
    estimated: Clocks | None,
) -> dict[str, Any]:
    cameras: dict[str, Any] = {}
    for i, view in enumerate(views):
        own = {"offset_s": used[i].offset_s, "rate_ppm": used[i].rate_ppm, "source": "config"}
        if given[i] == "auto" and estimated is not None:
            offset, rate = estimated.interval95(i)
            own |= {"source": "motion" if estimated.sd[i].offset_s else "reference"}
            own |= {"offset_s_sd": estimated.sd[i].offset_s, "rate_ppm_sd": estimated.sd[i].rate_ppm}
            own |= {"offset_s_95": list(offset), "rate_ppm_95": list(rate), "ambiguous": estimated.ambiguous[i]}
            if np.isfinite(estimated.error_by_offset[i]).any():
                tried = (estimated.offsets + used[i].offset_s).tolist()
                own |= {"offsets_s": tried, "error_px": estimated.error_by_offset[i].tolist()}
        cameras[view.name] = own
    record: dict[str, Any] = {"cameras": cameras}
    if estimated is not None:
        record |= {"error_px": estimated.error_px, "error_before_px": estimated.error_before_px}
    return record


def _match_record(
    views: Sequence[_View], match: Correspondence, labels: Sequence[str], located: Located, tolerance_px: float
) -> dict[str, Any]:
    scale = _world_per_px(views, located)
    targets = {}
    for k, label in enumerate(labels):
        targets[label] = {
            "tracks": {
                v.name: [v.tracks[i] for i in np.flatnonzero(t == k)] for v, t in zip(views, match.target, strict=True)
            },
            "error_px": float(match.error_px[k]),
            "error": float(match.error_px[k]) * scale,
            "runner_up_px": float(match.runner_up_px[k]),
            "ambiguous": bool(match.ambiguous[k]),
            "moments": int(match.n_common[k]),
        }
    unmatched = {
        v.name: [v.tracks[i] for i in np.flatnonzero(t == NONE)] for v, t in zip(views, match.target, strict=True)
    }
    return {
        "tolerance_px": tolerance_px,
        "tolerance": tolerance_px * scale,
        "world_per_px": scale,
        "targets": targets,
        "unmatched": {name: tracks for name, tracks in unmatched.items() if tracks},
    }


def _world_per_px(views: Sequence[_View], located: Located) -> float:
    """World units that one px spans where the targets are, median over cameras and samples."""
    p = located.point.reshape(-1, 3)
    p = p[np.isfinite(p[:, 0])][:: max(1, len(p) // 1000)]
    if not len(p):
        return float("nan")
    depths = [p @ v.camera.R[2] + v.camera.T[2] for v in views]
    return float(np.median([d * v.camera.dy / v.camera.f for d, v in zip(depths, views, strict=True)]))


def _noise_record(views: Sequence[_View], located: Located, b: Array, sd: Array, noise: float) -> dict[str, Any]:
    seen = np.isfinite(b) & np.isfinite(located.point[..., 0])[None, ..., None]
    used = seen & ~located.left_out[..., None]

    def rms(i: int) -> float:
        e = located.error[i][used[i]]
        return float(np.sqrt(np.mean(e**2))) if e.size else float("nan")

    return {
        "sd_px": {v.name: float(np.median(sd[i][seen[i]])) if seen[i].any() else None for i, v in enumerate(views)},
        "factor": noise,
        "source": "tracker, scaled by the reprojection errors" if all(v.has_sd for v in views) else "reprojection",
        "reprojection_rms_px": {v.name: rms(i) for i, v in enumerate(views)},
    }


def _sample_record(views: Sequence[_View], table: pd.DataFrame, located: Located) -> dict[str, Any]:
    found = table["x"].notna().to_numpy()

    def mean(name: str) -> float | None:
        return float(table.loc[found, name].mean()) if found.any() else None

    return {
        "n": len(table),
        "located": int(found.sum()),
        "by_n_cameras": {str(n): int((table["n_cameras"] == n).sum()) for n in sorted(table["n_cameras"].unique())},
        "left_out": {v.name: int(located.left_out[i].sum()) for i, v in enumerate(views)},
        "disagree": int(located.disagree.sum()),
        "mean_miss": mean("miss"),
        "mean_sigma": [mean(f"sigma_{a}") for a in "xyz"],
    }


def _volume_record(outside: Array | None, units: str) -> dict[str, Any] | None:
    if outside is None or not np.isfinite(outside).any():
        return None
    known = outside[np.isfinite(outside)]
    return {"share_outside": float((known > 0).mean()), "farthest_outside": float(known.max()), "units": units}


def _warnings(
    record: Mapping[str, Any],
    views: Sequence[_View],
    located: Located,
    b: Array,
    sd: Array,
    units: str,
    tolerance_px: float,
) -> list[str]:
    out = []
    if not record["correspondence"]["targets"]:
        out.append(f"targets: no two cameras' tracks agree within {tolerance_px:g} px: check the calibration or clocks")
    for name, target in record["correspondence"]["targets"].items():
        if target["ambiguous"]:
            out.append(
                f"target {name}: another match explains the tracks about as well ({target['error_px']:.3g} against "
                f"{target['runner_up_px']:.3g} px). Name the targets in targets.csv, or add a camera."
            )
    for camera, tracks in record["correspondence"]["unmatched"].items():
        out.append(f"{camera}: no other camera shows the same target as {', '.join(tracks)}")
    volume = record["volume"]
    if volume and volume["share_outside"] > 0.01:
        out.append(
            f"{100 * volume['share_outside']:.0f} % of the samples lie outside the calibrated volume, by up to "
            f"{volume['farthest_outside']:.3g} {units}. Calibrate with points around the whole motion."
        )
    if record["samples"]["disagree"]:
        out.append(
            f"{record['samples']['disagree']} samples have no fix because the cameras disagree by more than "
            f"{tolerance_px:g} px; mean miss there {np.nanmean(located.miss[located.disagree]):.3g} {units}"
        )
    return out

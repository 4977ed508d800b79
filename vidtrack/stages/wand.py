"""Stage wand: what every camera followed of a waved wand becomes its calibration; no survey is needed.

The world's axes come from surveyed points, from directions that the user names, or they are the first camera's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.adjust import Adjusted
from vidtrack.calibration.adjustment.unknowns import columns
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.calibration.wand.axes import Fall
from vidtrack.calibration.wand.drop import dropped
from vidtrack.calibration.wand.ends import jointly, ordered, orders, stretches
from vidtrack.calibration.wand.judged import Judged, judge
from vidtrack.calibration.wand.measured import Wand
from vidtrack.calibration.wand.placed import PICK_SD, Marks, Placed, placed
from vidtrack.calibration.wand.projections import by_projection
from vidtrack.calibration.wand.refined import Refined, refine_wand
from vidtrack.calibration.wand.rig import find_rig
from vidtrack.calibration.wand.stated_clocks import stated_times
from vidtrack.calibration.wand.tracks import Arranged, Follows, Timed
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.projection import Projection
from vidtrack.location.cameras.ball_middles import at_middles
from vidtrack.timing.readout import Readout, table_at_frame_time
from vidtrack.timing.timecode import Timecode

Rows = Mapping[str, Any]
CLEAR = ("", "recovered")
"""Flags of samples that show a whole ball."""
STILL_SAMPLES, STILL_PX = 25, 2.0
"""What stays within so many px for so many samples does not belong to a wand that is waved."""
LEAST_SD = 0.05
"""px, of a centroid whose table has none."""
AGAIN_PX = 0.01
"""By which the middles of balls' outlines lie off these, at most, for the cameras not to be sought again."""


class Calibrated(NamedTuple):
    """What `calibrate_by_wand` returns, for m cameras."""

    cameras: tuple[Camera, ...]
    uncertainties: tuple[Uncertainty, ...]
    records: tuple[dict[str, Any], ...]  # of each camera.json
    points: tuple[pd.DataFrame, ...]  # of each camera, the balls as points.parquet has them
    wand: pd.DataFrame  # a row a moment and ball: time_s, end, x, y, z, sigma_x ..., length_error
    record: dict[str, Any]
    findings: tuple[Finding, ...]


def calibrate_by_wand(
    tracks: Mapping[str, pd.DataFrame],
    nominal: Mapping[str, Camera],
    wand: Wand,
    *,
    units: str,
    late: Sequence[str] = (),
    model: str = "auto",
    priors: Mapping[str, Mapping[str, tuple[float, float]]] | None = None,
    fixed: Mapping[str, Mapping[str, float | None]] | None = None,
    points: Mapping[str, pd.DataFrame] | None = None,
    picks: pd.DataFrame | None = None,
    axes: Mapping[str, Any] | str | None = None,
    drop: Mapping[str, pd.DataFrame] | None = None,
) -> Calibrated:
    """Cameras from the tracks of a waved wand.

    tracks   camera: all that it followed (tracklets, as stage track gives them), time_s by the run's scale
    nominal  camera: Cx, Cy, dx, dy, image_size; f where the config fixes it
    late     cameras whose clocks are unknown
    points   camera: sightings of surveyed points
    picks    camera, tag, Xf, Yf of points that are not surveyed, for `axes`
    axes     None: the points where there are any; 'camera': those of the first camera; else {origin, x, y, up, level}
    drop     camera: the track of a ball that falls
    Raises VidtrackError with what does not fit.
    """
    names = list(tracks)
    if len(names) < 2:
        raise VidtrackError(f"calibration.wand: {len(names)} camera filmed the wand; it needs two that see it at once.")
    cameras = [_fixed(nominal[name], (fixed or {}).get(name, {})) for name in names]
    ways = orders(wand.lengths)
    focal = [_focal(name, fixed, priors) for name in names]

    def of_tracks(tracks: Mapping[str, pd.DataFrame]) -> tuple[Refined, Timed]:
        follows = [_follow(name, tracks[name], len(wand.ends), wand) for name in names]
        timed = Timed(follows, ways, [names.index(name) for name in late])
        b = timed.sampled(np.zeros(len(names))).b

        def solved(projection: Projection, models: tuple[str, ...]) -> Refined:
            nominal = [camera.with_(projection=projection) for camera in cameras]
            rig = find_rig(b, timed.stretch(), nominal, wand, focal, np.random.default_rng(0))
            return refine_wand(
                rig.cameras,
                timed.sampled,
                wand,
                arrange=Arranged(ways, b, rig.b),
                models=models,
                priors=[dict((priors or {}).get(name, {})) for name in names],
                fixed=[tuple((fixed or {}).get(name, {})) for name in names],
                late=timed.late,
            )

        try:
            return by_projection(solved, model), timed
        except ValueError as error:
            raise VidtrackError(
                f"calibration.wand: {_named(str(error), names)}. Wave the wand slowly through all of the volume, "
                "turning it, every ball in at least two pictures, and see that detect finds the balls and nothing else."
            ) from None

    done, timed = of_tracks(tracks)
    eyes = dict(zip(names, done.cameras, strict=True))
    moved = at_middles(tracks, eyes)
    if moved.largest_px > AGAIN_PX:  # the balls are large: the cameras that saw their middles
        done, timed = of_tracks(moved.tables)
    points, drop = (tables and at_middles(tables, eyes).tables for tables in (points, drop))
    where = "calibration.wand.axes"
    fall = _fall(done, names, drop, timed)
    surveyed, picked = _surveyed(points, names), _picked(picks, names)
    try:
        at = placed(done, wand, surveyed=surveyed, picked=picked, axes=axes, fall=fall)
    except ValueError as error:
        cure = "Name four surveyed balls in picks.csv, or pick points in the wand's clip and name them in axes"
        raise VidtrackError(f"{where}: {error}. {cure}, or set {where}: camera.") from None
    return _calibrated(done, at, names, wand, units, timed)


def on_stated_clocks(
    tracks: Mapping[str, pd.DataFrame],
    codes: Mapping[str, Timecode | None],
    clocks: Mapping[str, Any],
    readouts: Mapping[str, Readout],
    where: str,
) -> tuple[dict[str, pd.DataFrame], list[str]]:
    """The tracks with time_s on one scale, and the cameras whose clocks are unknown: see `stated_times`.

    Where a camera's rows are seen one after the other, the tracks are at the times of their frames.
    """
    stated = stated_times({name: own["time_s"].to_numpy(float) for name, own in tracks.items()}, codes, clocks, where)
    timed = {name: own.assign(time_s=stated.times[name]) for name, own in tracks.items()}
    for name, table in timed.items():
        by = "tracklet" if "tracklet" in table else "target"
        timed[name] = table.assign(**table_at_frame_time(dict(table), by, readouts[name]))
    return timed, stated.unknown


def _follow(name: str, table: pd.DataFrame, q: int, wand: Wand) -> Follows:
    """The balls of one camera, of everything that it followed: at each moment those that are followed longest.

    Moments at which fewer are seen stay incomplete; what never moves is scenery.
    """
    if "tracklet" not in table:
        table = table.assign(tracklet=pd.factorize(table["target"])[0])
    table = table[table["field"] != "bottom"] if "field" in table else table
    table = table[table["flag"].fillna("").isin(CLEAR) & table["Xf"].notna()]
    table = table[~table["tracklet"].isin(_still(table))]
    if table["tracklet"].nunique() < q:
        n = table["tracklet"].nunique()
        raise VidtrackError(
            f"calibration.wand: {name} followed {n} moving balls, the wand has {q}. See calibration.wand.detect."
        )
    moments, row = np.unique(table["time_s"].to_numpy(float), return_inverse=True)
    piece = table["tracklet"].to_numpy(int)
    xy, own_sd = table[["Xf", "Yf"]].to_numpy(float), table[["sd_x", "sd_y"]].to_numpy(float)
    _, place, counts = np.unique(piece, return_inverse=True, return_counts=True)
    order = np.lexsort((-counts[place], row))
    b, sd = np.full((len(moments), q, 2), np.nan), np.full((len(moments), q, 2), np.nan)
    whose = np.full((len(moments), q), -1)
    starts = np.searchsorted(row[order], np.arange(len(moments) + 1))
    before = np.full(q, -1)
    for k in range(len(moments)):
        here = order[starts[k] : starts[k + 1]][:q]
        free = [slot for slot in range(q) if before[slot] not in piece[here]]
        for i in here:
            same = np.flatnonzero(before == piece[i])
            slot = int(same[0]) if same.size else free.pop(0)
            b[k, slot], sd[k, slot], whose[k, slot] = xy[i], own_sd[i], piece[i]
        before = np.where(whose[k] >= 0, whose[k], before)
    typical = np.nanmedian(sd) if np.isfinite(sd).any() else 1.0
    sd = np.maximum(np.where(np.isfinite(sd), sd, typical), LEAST_SD)
    known = pd.DataFrame(np.where(whose >= 0, whose, np.nan)).ffill().to_numpy()
    change = np.zeros(len(moments), bool)
    change[1:] = (known[1:] != known[:-1]).any(-1)
    return Follows(moments, ordered(b, wand.lengths), sd, jointly([stretches(b), np.cumsum(change)]))


def _still(table: pd.DataFrame) -> list[int]:
    """Tracklets that stay where they are for a second and more: scenery."""
    still = []
    for number, own in table.groupby("tracklet"):
        reach = np.ptp(own[["Xf", "Yf"]].to_numpy(float), axis=0).max()
        if len(own) > STILL_SAMPLES and reach < STILL_PX:
            still.append(int(number))  # type: ignore[arg-type]
    return still


def _fixed(camera: Camera, fixed: Mapping[str, float | None]) -> Camera:
    return camera.with_(**{name: value for name, value in fixed.items() if value is not None})


def _focal(
    name: str,
    fixed: Mapping[str, Mapping[str, float | None]] | None,
    priors: Mapping[str, Mapping[str, tuple[float, float]]] | None,
) -> tuple[float, ...] | None:
    value = (fixed or {}).get(name, {}).get("f")
    if value is not None:
        return (value,)
    known = (priors or {}).get(name, {}).get("f")
    return None if known is None else (known[0] - known[1], known[0], known[0] + known[1])


def _named(text: str, names: Sequence[str]) -> str:
    for i, name in enumerate(names):
        text = text.replace(f"camera {i} ", f"camera {name} ")
    return text


def _fall(done: Refined, names: Sequence[str], drop: Mapping[str, pd.DataFrame] | None, timed: Timed) -> Fall | None:
    """The fall of a dropped ball, seen by the cameras in their own axes."""
    if not drop:
        return None
    tracks: dict[int, tuple[Array, Array]] = {}
    for name, own in drop.items():
        clear = own[own["flag"].fillna("").isin(CLEAR) & own["Xf"].notna()]
        clear = clear.drop_duplicates("time_s").sort_values("time_s")
        tracks[names.index(name)] = clear["time_s"].to_numpy(float), clear[["Xf", "Yf"]].to_numpy(float)
    try:
        return dropped(done, timed, tracks)
    except ValueError as error:
        raise VidtrackError(f"calibration.wand.axes.drop: {error}. Film the drop again, or leave drop out.") from None


def _picked(picks: pd.DataFrame | None, names: Sequence[str]) -> Marks | None:
    if picks is None or picks.empty:
        return None
    tags = tuple(dict.fromkeys(picks["tag"].astype(str)))
    seen = np.full((len(names), len(tags), 2), np.nan)
    for _, pick in picks.iterrows():
        if str(pick["camera"]) in names:
            seen[names.index(str(pick["camera"])), tags.index(str(pick["tag"]))] = (pick["Xf"], pick["Yf"])
    return Marks(tags, seen, np.full(seen.shape, PICK_SD))


def _surveyed(points: Mapping[str, pd.DataFrame] | None, names: Sequence[str]) -> Marks | None:
    if not points:
        return None
    rows = pd.concat([table.assign(camera=name) for name, table in points.items() if name in names])
    rows = rows[rows["Xf"].notna()].drop_duplicates(["camera", "tag"])
    tags = tuple(dict.fromkeys(rows["tag"].astype(str)))
    seen, sd = np.full((len(names), len(tags), 2), np.nan), np.full((len(names), len(tags), 2), PICK_SD)
    p, sigma = np.full((len(tags), 3), np.nan), np.zeros(len(tags))
    for _, row in rows.iterrows():
        i, k = names.index(str(row["camera"])), tags.index(str(row["tag"]))
        seen[i, k] = row["Xf"], row["Yf"]
        own = np.array([row.get("sd_x", np.nan), row.get("sd_y", np.nan)], float)
        sd[i, k] = np.maximum(np.where(np.isfinite(own), own, PICK_SD), LEAST_SD)
        p[k], sigma[k] = (row["x"], row["y"], row["z"]), row["sigma"] if np.isfinite(row["sigma"]) else 0.0
    return Marks(tags, seen, sd, p, sigma)


def _calibrated(done: Refined, at: Placed, names: Sequence[str], wand: Wand, units: str, timed: Timed) -> Calibrated:
    uncertainties = tuple(
        Uncertainty(own, at.pivot, at.joint[place, place])
        for own, (place, _) in zip(at.free, columns(at.free), strict=True)
    )
    sigma_px = float(at.adjusted.factors.get("px", 1.0) * np.nanmedian(done.views.sd))
    unsure = [names[i] for i in timed.unsure]
    judged: Judged = judge(done, at.cameras, at.adjusted, at.points, wand, names, at.axes, units, unsure)
    order = {"cameras": list(names), "names": [list(n) for n in at.free], "covariance": at.joint}
    records, tables = [], []
    for i, name in enumerate(names):
        b = done.views.b[i]
        left = np.linalg.norm(b - project(at.cameras[i], at.points), axis=-1)
        used = np.isfinite(left)
        records.append(
            {
                "model": done.model,
                "units": units,
                "refine": "wand",
                "n_points": int(used.sum()),
                "n_sighted": int(used.sum() + done.left_out[i].sum()),
                "rms_px": float(np.sqrt((left[used] ** 2).mean())),
                "max_px": float(left[used].max()),
                "sigma_px": sigma_px,
                "joint": order,
                "ladder": {"reasons": [_reason(done, wand, units)]},
                "findings": as_records(judged.by_camera.get(name, [])),
            }
        )
        tables.append(_points(wand, at.points, b, done.views.sd[i], used))
    record = {
        "cameras": list(names),
        "lengths": wand.values,
        "moments": len(done.rows),
        "left_out": int(done.left_out.sum()),
        "axes": at.axes.as_record(),
        "clocks": {
            names[i]: {"offset_s": float(timed.shift[i] + done.clocks[i]), "sd_s": done.clock_sd[i]} for i in timed.late
        },
        "model": done.model,
        "held_out": [rung._asdict() for rung in done.rungs],
        "sigma_px": sigma_px,
        "diagonal_field": float(np.linalg.norm(np.ptp(at.points.reshape(-1, 3), axis=0))),
        **judged.numbers,
        "findings": as_records(judged.findings),
    }
    frames = _frames(timed.at[done.rows], wand, at.points, at.adjusted)
    return Calibrated(at.cameras, uncertainties, tuple(records), tuple(tables), frames, record, tuple(judged.findings))


def _reason(done: Refined, wand: Wand, units: str) -> str:
    if not done.rungs:
        return f"Lens model {done.model}, as the config says."
    each = ", ".join(f"{rung.model} {rung.length_rms:.3g} {units}" for rung in done.rungs)
    return f"Lens model {done.model}: the wand's length at moments left out is off by (rms) {each}."


def _points(wand: Wand, points: Array, b: Array, sd: Array, used: Array) -> pd.DataFrame:
    rows, ends = np.nonzero(used)
    table = pd.DataFrame({"clip": "wand", "tag": [f"{wand.ends[k]} {n}" for n, k in zip(rows, ends, strict=True)]})
    for k, axis in enumerate("xyz"):
        table[axis] = points[rows, ends, k]
    table["sigma"] = np.nan
    for k, axis in enumerate(("x", "y")):
        table[f"{'XY'[k]}f"] = b[rows, ends, k]
        table[f"sd_{axis}"] = sd[rows, ends, k]
    table["pixels"], table["frames"], table["used"], table["reason"] = 0, 1, True, ""
    return table


def _frames(at: Array, wand: Wand, points: Array, found: Adjusted) -> pd.DataFrame:
    n, q = points.shape[:2]
    deviation = np.sqrt(np.einsum("naa->na", found.blocks[0])).reshape(n, q, 3)
    table = pd.DataFrame({"time_s": np.repeat(at, q), "end": np.tile(np.array(wand.ends, object), n)})
    for k, axis in enumerate("xyz"):
        table[axis] = points[..., k].ravel()
        table[f"sigma_{axis}"] = deviation[..., k].ravel()
    return table

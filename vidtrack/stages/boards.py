"""Stage boards: the corners that all cameras saw of a board become their lenses, and their places to each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.board import Board
from vidtrack.calibration.board_fit import BoardFit, NoLens, fit_board, seen_corners
from vidtrack.calibration.gates import hull_area
from vidtrack.calibration.refine import Uncertainty
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.lens_terms import LENS_MODELS

MOST_VIEWS = 40
"""Views of a camera that are used: more add little but time."""
LEAST_CORNERS = 6
"""Corners of a view below which it says nothing but where the board is."""
BLURRED = 3.0
"""Times the camera's median sd of a view's corners beyond which it is too blurred to help."""
BENT = 4.0
"""Standard deviations of what a board's shape is known by beforehand, from which it is called bent."""
ROUGH_PX = 0.5
"""px of residuals from which the board, its numbers or the picture are in doubt: corners are good to a tenth."""
COVERED = 0.3
"""Share of the picture that the corners of all views should cover."""
NOT_TOGETHER = 3.0
"""Times the noise of single cameras that the joint fit leaves, from which the clips were not filmed together."""

View = tuple[str, int]


class Boards(NamedTuple):
    """What the stage gives, by camera: the camera (in the world of one view), what is known of it, and its record."""

    cameras: dict[str, Camera]
    uncertainties: dict[str, Uncertainty]
    records: dict[str, dict[str, Any]]
    sightings: dict[str, pd.DataFrame]  # corners with their places in the world: clip, tag, x, y, z, Xf, Yf, sd_x ...
    record: dict[str, Any]
    findings: tuple[Finding, ...]


def boards(
    corners: Mapping[str, pd.DataFrame],
    sizes: Mapping[str, tuple[int, int]],
    board: Board,
    *,
    world: str | None = None,
    units: str = "",
    model: str = "auto",
) -> Boards:
    """The cameras that a board was shown to.

    corners  by camera: clip, frame, corner, Xf, Yf, sd (px)
    sizes    by camera: px, (width, height)
    world    "clip/frame" whose board is the world; default: the view that most cameras see best
    Views of the same clip and frame are taken for one moment: the clips of several cameras run together, or their
    pictures are numbered alike. Cameras whose joint fit contradicts that are fitted alone.
    Raises VidtrackError where a camera's views give no lens.
    """
    findings: list[Finding] = []
    views, left_out = _chosen(corners, sizes)
    names = list(corners)
    b, sd = _arrays(corners, names, views, len(board.corners))
    origin = _world(b, views, world)
    fits = _fits(board, b, sd, [sizes[name] for name in names], origin, names, views, model, findings)
    cameras, known, records, sightings = {}, {}, {}, {}
    findings.insert(0, _used(views, left_out, views[origin]))
    common = list(findings)
    for i, name in enumerate(names):
        fit, row, used = fits[i]
        cameras[name] = fit.cameras[row].with_(name=name)
        known[name] = fit.uncertainties[row]
        own = _doubts(name, board, fit, row, sizes[name], units)
        offered = len(_views(corners[name]))
        records[name] = _record(fit, row, len(used), offered, units) | {"findings": as_records([*common, *own])}
        findings += own
        sightings[name] = _sightings(board, fit, row, [views[k] for k in used])
    together = len({id(fit) for fit, _, _ in fits}) == 1
    record = {
        "cameras": names,
        "units": units,
        "together": together,
        "world": f"{views[origin][0]}/{views[origin][1]}",
        "views": [f"{clip}/{frame}" for clip, frame in views],
        "left_out": left_out,
        "findings": as_records(findings),
    }
    return Boards(cameras, known, records, sightings, record, tuple(findings))


def _used(views: Sequence[View], left_out: Mapping[str, Mapping[str, int]], origin: View) -> Finding:
    """Which views were used, and why others were not."""
    blurred = sum(own["blurred"] for own in left_out.values())
    alike = sum(own["like_others"] for own in left_out.values())
    text = (
        f"calibration: {len(views)} views of the board were used, spread over the picture and the tilts; {blurred} "
        f"were left out as blurred, {alike} as like others. The world is the board in {origin[0]}/{origin[1]}, where "
        "no points are surveyed: x along its columns, y up its rows, z out of its face"
    )
    return Finding("note", "board-views", f"{text}.")


def _chosen(
    corners: Mapping[str, pd.DataFrame], sizes: Mapping[str, tuple[int, int]]
) -> tuple[list[View], dict[str, dict[str, int]]]:
    """The views that are used: for each camera sharp ones, spread farthest; and how many were not, and why."""
    chosen: dict[View, None] = {}
    left_out = {}
    seen_by: dict[View, int] = {}
    for table in corners.values():
        for view in _views(table):
            seen_by[view] = seen_by.get(view, 0) + 1
    for name, table in corners.items():
        width, height = sizes[name]
        views = []
        for view, own in _views(table).items():
            b = own[["Xf", "Yf"]].to_numpy(float)
            if len(b) < LEAST_CORNERS:
                continue
            C = np.cov(b.T)
            size = np.sqrt(max(np.linalg.det(C), 1e-9)) / (width * height) * 20
            shape = [C[0, 0] - C[1, 1], 2 * C[0, 1]] / max(np.trace(C), 1e-9)
            features = np.array([*(b.mean(0) / (width, height)), np.log(size) / 3, *shape])
            views.append((view, float(own["sd"].median()), len(own), features))
        if not views:
            raise VidtrackError(f"cameras.{name}: no view shows {LEAST_CORNERS} corners of the board. Film it nearer.")
        limit = BLURRED * float(np.median([sd for _, sd, _, _ in views]))
        sharp = [each for each in views if each[1] <= limit]
        picked = _spread([v[3] for v in sharp], [v[2] * seen_by[v[0]] for v in sharp], MOST_VIEWS)
        chosen |= dict.fromkeys(sharp[i][0] for i in picked)
        left_out[name] = {"blurred": len(views) - len(sharp), "like_others": len(sharp) - len(picked)}
    return sorted(chosen), left_out


def _views(table: pd.DataFrame) -> dict[View, pd.DataFrame]:
    """The corners of each view."""
    groups = table.groupby([table["clip"].astype(str), table["frame"].astype(int)])
    return {(str(key[0]), int(str(key[1]))): own for key, own in groups}


def _spread(features: Sequence[Array], weight: Sequence[int], most: int) -> list[int]:
    """Indices of at most so many, each the farthest from those before it; the first has most corners and cameras."""
    if not features:
        return []
    F, w = np.array(features), np.sqrt(np.array(weight, float) / max(weight))
    picked = [int(np.argmax(weight))]
    distance = np.linalg.norm(F - F[picked[0]], axis=-1)
    while len(picked) < min(most, len(F)):
        best = int(np.argmax(distance * w))
        if distance[best] <= 1e-3:
            break
        picked.append(best)
        distance = np.minimum(distance, np.linalg.norm(F - F[best], axis=-1))
    return picked


def _arrays(
    corners: Mapping[str, pd.DataFrame], names: Sequence[str], views: Sequence[View], q: int
) -> tuple[Array, Array]:
    place = {view: k for k, view in enumerate(views)}
    b, sd = np.full((len(names), len(views), q, 2), np.nan), np.full((len(names), len(views), q), 1.0)
    for i, name in enumerate(names):
        table = corners[name]
        rows = np.array([place.get((str(c), int(f)), -1) for c, f in zip(table["clip"], table["frame"], strict=True)])
        j, good = table["corner"].to_numpy(int), rows >= 0
        good &= j < q
        b[i, rows[good], j[good]] = table[["Xf", "Yf"]].to_numpy(float)[good]
        sd[i, rows[good], j[good]] = table["sd"].to_numpy(float)[good]
    return b, sd


def _world(b: Array, views: Sequence[View], world: str | None) -> int:
    """The view that is the world."""
    counts = np.isfinite(b).all(-1).sum(-1)  # (m, n)
    if world is None:
        return int(np.argmax((counts >= 6).sum(0) * 1e6 + counts.sum(0)))
    clip, _, frame = world.rpartition("/")
    if (clip, int(frame)) in views:
        return views.index((clip, int(frame)))
    near = [f"{c}/{f}" for c, f in views if c == clip]
    raise VidtrackError(
        f"calibration.board.world: no camera sees the board in {world}, or that view is blurred. Views that are used: "
        f"{', '.join(near[:8]) or ', '.join(f'{c}/{f}' for c, f in views[:8])}."
    )


Fitted = tuple[BoardFit, int, list[int]]


def _fits(
    board: Board,
    b: Array,
    sd: Array,
    sizes: list[tuple[int, int]],
    origin: int,
    names: list[str],
    views: Sequence[View],
    model: str,
    findings: list[Finding],
) -> list[Fitted]:
    """For each camera the fit that it is in, its row there and the views of that fit: all together, or each alone."""
    alone = [_alone(board, b, sd, sizes, origin, names, i, model) for i in range(len(names))]
    if len(names) == 1:
        return alone
    used = np.flatnonzero((np.isfinite(b).all(-1).sum(-1) >= 6).any(0))
    cure = "Film the board by all cameras at once, or number their pictures alike."
    try:
        chosen = max((fit.model for fit, _, _ in alone), key=list(LENS_MODELS).index)
        start = int(np.flatnonzero(used == origin)[0])
        fit = fit_board(board, b[:, used], sd[:, used], sizes, start, model=chosen)
    except NoLens as none:
        text = f"calibration: the cameras are not placed to each other by the board: {none}."
        findings.append(Finding("doubtful", "boards-not-connected", text, cure))
        return alone
    noise = float(np.median([each.sigma_px for each, _, _ in alone]))
    if fit.sigma_px > NOT_TOGETHER * noise:
        text = (
            f"calibration: the board's views of {', '.join(names)} do not fit together ({fit.sigma_px:.2g} px, "
            f"{noise:.2g} px each alone): not the same moments, or not the same board."
        )
        findings.append(Finding("doubtful", "boards-not-simultaneous", text, cure))
        return alone
    return [(fit, i, used.tolist()) for i in range(len(names))]


def _alone(
    board: Board, b: Array, sd: Array, sizes: list[tuple[int, int]], origin: int, names: list[str], i: int, model: str
) -> Fitted:
    counts = np.isfinite(b[i]).all(-1).sum(-1)
    used = np.flatnonzero(counts >= 6)
    if not len(used):
        raise VidtrackError(f"cameras.{names[i]}: no view shows 6 corners of the board. Film it nearer.")
    start = int(np.flatnonzero(used == origin)[0]) if origin in used else int(np.argmax(counts[used]))
    try:
        fit = fit_board(board, b[i : i + 1, used], sd[i : i + 1, used], sizes[i : i + 1], start, model=model)
    except NoLens as none:
        raise VidtrackError(f"cameras.{names[i]}: {none}.") from None
    return fit, 0, used.tolist()


def _doubts(name: str, board: Board, fit: BoardFit, row: int, size: tuple[int, int], units: str) -> list[Finding]:
    """What the views say against the board, the lens or the way it was filmed."""
    where, findings = f"cameras.{name}", []
    left = fit.residuals[row]
    seen = np.isfinite(left).all(-1)
    rms = float(np.sqrt((left[seen] ** 2).sum(-1).mean() / 2))
    if not fit.converged:
        text = f"{where}: the adjustment of the board's views did not converge."
        findings.append(Finding("doubtful", "board-not-converged", text, "Add sharp views, tilted to all sides."))
    if rms > ROUGH_PX:
        text = f"{where}: the corners lie {rms:.2g} px from where board and lens put them; 0.1 px is usual."
        cure = "Is it one flat board, are columns, rows, square and marker right, and are the pictures sharp?"
        findings.append(Finding("doubtful", "board-rough", text, cure))
    for shape, value in fit.shape.items():
        sd = board.shape_priors[shape][1]
        if row == 0 and abs(value) > BENT * sd:
            size_text = f"{abs(value):.2g} {units}" if shape != "stretch" else f"{100 * abs(value):.2g} %"
            text = f"{where}: the board is bent or scaled unevenly ({shape} {size_text})."
            findings.append(Finding("doubtful", "board-bent", text, "Glue it to a flat plate; measure both its sides."))
            break
    width, height = size
    corners = _predicted(fit, row, board)[seen]
    share = hull_area(corners) / (width * height)
    if share < COVERED:
        text = f"{where}: the board was in {100 * share:.0f} % of the picture only; beyond it the lens is extrapolated."
        findings.append(Finding("doubtful", "board-in-a-corner", text, "Show it in every corner of the picture."))
    sd_f = dict(zip(fit.uncertainties[row].names, fit.uncertainties[row].standard_errors.tolist(), strict=True))["f"]
    if sd_f > 0.005 * fit.cameras[row].f:
        text = f"{where}: the views leave f +- {100 * sd_f / fit.cameras[row].f:.1f} %."
        findings.append(Finding("doubtful", "board-views-poor", text, "Tilt the board by 20 to 45 deg, to all sides."))
    return findings


def _predicted(fit: BoardFit, row: int, board: Board) -> Array:
    """Where camera `row` sees every corner (n, q, 2) px."""
    return project(fit.cameras[row], seen_corners(board, fit))


def _record(fit: BoardFit, row: int, used: int, offered: int, units: str) -> dict[str, Any]:
    left = fit.residuals[row]
    seen = np.isfinite(left).all(-1)
    length = np.linalg.norm(left[seen], axis=-1)
    return {
        "model": fit.model,
        "units": units,
        "refine": "full",
        "n_points": int(seen.sum()),
        "n_sighted": int(seen.sum()),
        "rms_px": float(np.sqrt((length**2).mean())),
        "max_px": float(length.max()),
        "sigma_px": fit.sigma_px,
        "board": {
            "views": used,
            "views_offered": offered,
            "held_out_px": dict(fit.held_out_px),
            "shape": dict(fit.shape),
            "shape_sd": dict(fit.shape_sd),
            "sd_factor": fit.factor,
        },
    }


def _sightings(board: Board, fit: BoardFit, row: int, views: Sequence[View]) -> pd.DataFrame:
    """Every corner that the camera saw, with its place in the world and its residuals."""
    places = seen_corners(board, fit)
    left = fit.residuals[row]
    k, j = np.nonzero(np.isfinite(left).all(-1))
    b = _predicted(fit, row, board)[k, j] + left[k, j]
    return pd.DataFrame(
        {
            "clip": [views[a][0] for a in k.tolist()],
            "tag": [f"{views[a][1]}-{c}" for a, c in zip(k.tolist(), j.tolist(), strict=True)],
            **{axis: places[k, j, n] for n, axis in enumerate("xyz")},
            "sigma": 0.0,
            "Xf": b[:, 0],
            "Yf": b[:, 1],
            "pixels": 0,
            "frames": 1,
            "sd_x": fit.sigma_px,
            "sd_y": fit.sigma_px,
            "found": True,
            "reason": "",
            "used": True,
            "residual_x": left[k, j, 0],
            "residual_y": left[k, j, 1],
        }
    )

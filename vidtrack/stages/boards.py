"""Stage boards: the corners that all cameras saw of a board become their lenses, and their places to each other."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.tied_cameras import moved_camera
from vidtrack.calibration.boards.board import STRETCH, Board
from vidtrack.calibration.boards.board_corners import Seen
from vidtrack.calibration.boards.board_doubts import board_doubts, predicted
from vidtrack.calibration.boards.board_fit import BoardFit, NoLens, fit_board, seen_corners
from vidtrack.calibration.boards.board_place import FEWEST_SURVEYED, Motion, survey_motion
from vidtrack.calibration.boards.board_turns import after, one_orientation
from vidtrack.calibration.boards.board_views import (
    LEAST_CORNERS,
    View,
    chosen_views,
    connected,
    corner_arrays,
    world_view,
)
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, as_records
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import LENS_MODELS

NOT_TOGETHER = 3.0
"""Times the noise of single cameras that the joint fit leaves, from which the clips were not filmed together."""


class Boards(NamedTuple):
    """What the stage gives, by camera: the camera (in the world of one view), what is known of it, and its record.

    A camera whose views give no lens has only a record, with `found` false.
    """

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
    surveyed: Collection[str] = (),
    survey: Mapping[str, pd.DataFrame] | None = None,
) -> Boards:
    """The cameras that a board was shown to.

    corners   by camera: clip, frame, corner, Xf, Yf, sd (px)
    sizes     by camera: px, (width, height)
    world     "clip/frame" whose board is the world; default: the view that most cameras see best
    surveyed  cameras that surveyed points place, wherever the board was
    survey    by camera: those points, where a camera that sees none is to be placed among the others: x, y, z, Xf, Yf
    Views of the same clip and frame are taken for one moment: the clips of several cameras run together, or their
    pictures are numbered alike. Cameras whose joint fit contradicts that are fitted alone, and a camera whose views
    give no lens is left out, with a finding.
    Raises VidtrackError where no camera's views give a lens.
    """
    findings: list[Finding] = []
    seen = {name: _views(table) for name, table in corners.items()}
    views, left_out = chosen_views(seen, sizes)
    seeing = [name for name, own in seen.items() if any(len(each.ids) >= LEAST_CORNERS for each in own.values())]
    why = {name: f"no view shows {LEAST_CORNERS} corners of the board" for name in corners if name not in seeing}
    b, sd = corner_arrays(seen, seeing, views, len(board.corners))
    if not seeing:
        cure = "Film the board from a shorter distance."
        raise VidtrackError(*(f"cameras.{name}: {reason}. {cure}" for name, reason in why.items()))
    origin = world_view(b, views, world)
    alone = {}
    for i, name in enumerate(seeing):
        try:
            alone[name] = _fitted(board, b, sd, [i], [sizes[name]], origin, model)
        except NoLens as none:
            why[name] = str(none)
    if not alone:
        raise VidtrackError(*(f"cameras.{name}: {reason}." for name, reason in why.items()))
    rows = [i for i, name in enumerate(seeing) if name in alone]
    names = [seeing[i] for i in rows]
    fits = _fits(board, b[rows], sd[rows], names, sizes, alone, origin, findings, surveyed)
    lost = {name: _lost(name, reason, surveyed) for name, reason in why.items()}
    findings.insert(0, _used(views, left_out, views[origin]))
    motions = {}
    for fit in fits:
        own = {name: _surveyed(survey[name]) for name in fit.names if survey and name in survey}
        motions[id(fit)] = _among_surveyed(fit, own, findings) if survey and set(fit.names) - set(surveyed) else None
    cameras, known, records, sightings = {}, {}, {}, {}
    common = list(findings)
    for fit in fits:
        moved = motions[id(fit)]
        for row, name in enumerate(fit.names):
            own_camera = fit.done.cameras[row].with_(name=name)
            cameras[name] = moved_camera(own_camera, *moved) if moved else own_camera
            u = fit.done.uncertainties[row]
            known[name] = u if moved is None else u._replace(pivot=moved[0] @ u.pivot + moved[1])
            own_doubts = board_doubts(name, board, fit.done, row, sizes[name], units)
            said = _record(fit.done, row, len(seen[name]), units)
            said["board"]["held_out_px"] = dict(alone[name][0].held_out_px)
            joint = {"joint": _joint(fit)} if len(fit.names) > 1 else {}
            records[name] = said | joint | {"findings": as_records([*common, *own_doubts])}
            findings += own_doubts
            sightings[name] = _sightings(board, fit.done, row, [views[k] for k in fit.views], moved)
    findings += lost.values()
    for name, finding in lost.items():
        records[name] = {"camera": name, "found": False, "findings": as_records([finding])}
        sightings[name] = next(iter(sightings.values())).head(0)
    record = {
        "cameras": list(corners),
        "units": units,
        "together": len(fits) == 1 and len(names) == len(corners),
        "ties": [
            _joint(fit) | {"pivot": known[fit.names[0]].pivot.tolist(), "scale_sd": STRETCH}
            for fit in fits
            if len(fit.names) > 1
        ],
        "world": f"{views[origin][0]}/{views[origin][1]}",
        "views": [f"{clip}/{frame}" for clip, frame in views],
        "left_out": left_out,
        "findings": as_records(findings),
    }
    return Boards(cameras, known, records, sightings, record, tuple(findings))


def _views(table: pd.DataFrame) -> dict[View, Seen]:
    """The corners of each view."""
    found = {}
    for key, own in table.groupby([table["clip"].astype(str), table["frame"].astype(int)]):
        b, sd = own[["Xf", "Yf"]].to_numpy(float), own["sd"].to_numpy(float)
        found[str(key[0]), int(str(key[1]))] = Seen(own["corner"].to_numpy(np.intp), b, sd)
    return found


def _surveyed(table: pd.DataFrame) -> tuple[Array, Array]:
    """Surveyed points (n, 3) that were found, and where (n, 2) px."""
    columns = table[["x", "y", "z", "Xf", "Yf"]].to_numpy(float)
    good = np.isfinite(columns).all(1) & (table["found"].to_numpy(bool) if "found" in table else True)
    return columns[good, :3], columns[good, 3:]


def _lost(name: str, why: str, surveyed: Collection[str]) -> Finding:
    """A camera whose views of the board give no lens."""
    if name in surveyed:
        text = f"cameras.{name}: the board gives no lens: {why}. The camera is calibrated by its surveyed points alone."
        return Finding("doubtful", "board-no-lens", text, "Film the board again, or remove its clip.")
    text = (
        f"cameras.{name}: the board gives no lens: {why}; and the camera sees no surveyed points. The camera is not "
        "calibrated."
    )
    return Finding("bad", "board-no-lens", text, "Film the board again, or survey points that this camera sees.")


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


class Fitted(NamedTuple):
    """A fit of some cameras, by name in its order, and the views that it used."""

    done: BoardFit
    names: list[str]
    views: list[int]


def _fitted(
    board: Board, b: Array, sd: Array, rows: list[int], sizes: list[tuple[int, int]], origin: int, model: str
) -> tuple[BoardFit, list[int]]:
    """Some of the cameras fitted together; the world is the view `origin`, or the best of theirs."""
    counts = np.isfinite(b[rows]).all(-1).sum(-1)
    used = np.flatnonzero((counts >= LEAST_CORNERS).any(0))
    start = int(np.flatnonzero(used == origin)[0]) if origin in used else int(np.argmax(counts[:, used].sum(0)))
    fit = fit_board(board, b[rows][:, used], sd[rows][:, used], sizes, start, model=model)
    return fit, used.tolist()


def _fits(
    board: Board,
    b: Array,
    sd: Array,
    names: list[str],
    sizes: Mapping[str, tuple[int, int]],
    alone: Mapping[str, tuple[BoardFit, list[int]]],
    origin: int,
    findings: list[Finding],
    surveyed: Collection[str],
) -> list[Fitted]:
    """The cameras, together where the board connects them, else each alone."""
    bare = set(names) - set(surveyed)
    cure = "Film the board by all cameras at once, or number their pictures alike."
    fits: list[Fitted] = []
    for rows in connected(b):
        own = [names[i] for i in rows]
        each = [Fitted(alone[name][0], [name], alone[name][1]) for name in own]
        if len(own) == 1:
            fits += each
            continue
        model = max((alone[name][0].model for name in own), key=list(LENS_MODELS).index)
        alike = one_orientation(board, b[rows], sd[rows], [_own_poses(*alone[name]) for name in own])
        if alike.unsure:
            text, way = _alike(board, [own[i] for i in alike.unsure], own)
            findings.append(Finding("bad" if bare & set(own) else "doubtful", "board-orientation", text, way))
            fits += each
            continue
        noise = float(np.median([alone[name][0].sigma_px for name in own]))
        try:
            together = list(range(len(rows)))
            done, views = _fitted(board, alike.b, alike.sd, together, [sizes[name] for name in own], origin, model)
            apart = f"{done.sigma_px:.2g} px, {noise:.2g} px each alone" if done.sigma_px > NOT_TOGETHER * noise else ""
        except NoLens as none:  # each has a lens and they share views: these contradict each other
            apart = str(none)
        if apart:
            text = (
                f"calibration: the board's views of {', '.join(own)} do not fit together ({apart}): not the same "
                "moments, or not the same board."
            )
            findings.append(Finding("bad" if bare & set(own) else "doubtful", "boards-not-simultaneous", text, cure))
            fits += each
        else:
            fits.append(Fitted(done, own, views))
    if len(fits) > 1 and not findings:
        groups = "; ".join(", ".join(fit.names) for fit in fits)
        text = f"calibration: no view of the board is shared by two of these groups of cameras: {groups}"
        worlds = [fit for fit in fits if bare & set(fit.names)]
        lost = len(worlds) > 1 or (bare and any(not set(fit.names) & set(surveyed) for fit in worlds) and surveyed)
        text += ". Each group has its own coordinate system." if lost else "."
        findings.append(Finding("bad" if lost else "note", "boards-not-connected", text, cure))
    return fits


def _own_poses(fit: BoardFit, views: Sequence[int]) -> dict[int, Array]:
    """By view, the board before the one camera of a fit (3, 4)."""
    camera = fit.cameras[0]
    return {
        view: after(np.concatenate([camera.R, camera.T[:, None]], -1), pose)
        for view, pose in zip(views, fit.poses, strict=True)
    }


def _alike(board: Board, unsure: Sequence[str], names: Sequence[str]) -> tuple[str, str]:
    """That the views do not determine which way up a symmetric board was, and what to do."""
    text = (
        f"calibration: a {board.type} board of {board.columns} x {board.rows} looks alike when it is turned, and the "
        f"views of {', '.join(names)} fit together either way: the place of {', '.join(unsure)} is not determined."
    )
    cure = "Tilt the board to other sides in views that the cameras share, or use a ChArUco board."
    if board.type == "checkerboard":
        cure += " A checkerboard with an even and an odd number of squares is not alike upside down."
    return text, cure


def _joint(fit: Fitted) -> dict[str, Any]:
    """What the cameras' parameters have in common, as camera.json has it."""
    names = [list(u.names) for u in fit.done.uncertainties]
    return {"cameras": fit.names, "names": names, "covariance": fit.done.covariance.tolist()}


def _among_surveyed(fit: Fitted, survey: Mapping[str, tuple[Array, Array]], findings: list[Finding]) -> Motion | None:
    """How the board's world moves to that of the survey; where it cannot, a finding."""
    motion = survey_motion(dict(zip(fit.names, fit.done.cameras, strict=True)), fit.done.model, survey)
    if motion is None:
        bare = ", ".join(name for name in fit.names if name not in survey)
        text = (
            f"calibration: {bare} see no surveyed points, and the board shows them to no camera that sees "
            f"{FEWEST_SURVEYED}: they are in the board's world, not in that of points.csv."
        )
        cure = "Survey points that they see, or film the board by them and the others at once."
        findings.append(Finding("bad", "boards-not-connected", text, cure))
    return motion


def _record(fit: BoardFit, row: int, offered: int, units: str) -> dict[str, Any]:
    left = np.linalg.norm(fit.residuals[row], axis=-1)
    length = left[np.isfinite(left)]
    return {
        "model": fit.model,
        "units": units,
        "refine": "full",
        "n_points": len(length),
        "n_sighted": len(length),
        "rms_px": float(np.sqrt((length**2).mean())),
        "max_px": float(length.max()),
        "sigma_px": fit.sigma_px,
        "board": {
            "views": int(np.isfinite(fit.residuals).any((0, 2, 3)).sum()),
            "views_offered": offered,
            "shape": dict(fit.shape),
            "shape_sd": dict(fit.shape_sd),
            "sd_factor": fit.factor,
        },
    }


def _sightings(board: Board, fit: BoardFit, row: int, views: Sequence[View], motion: Motion | None) -> pd.DataFrame:
    """Every corner that the camera saw, with its place in the world and its residuals."""
    places = seen_corners(board, fit)
    left = fit.residuals[row]
    k, j = np.nonzero(np.isfinite(left).all(-1))
    b = predicted(fit, row, board)[k, j] + left[k, j]
    places = places @ motion[0].T + motion[1] if motion else places
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

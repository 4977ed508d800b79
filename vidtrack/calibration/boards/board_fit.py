"""Cameras from the views of a board: the lens of each, their places to each other, and the board's own shape.

    minimise  sum |b - project(camera, R_k p(shape) + T_k)|^2 / sd^2  +  what is known of the board's shape beforehand

over every camera, every pose R_k, T_k of the board and its bending and stretch, by `calibration.adjustment`, whose
blocks are the poses. One pose is held: it is the world. Starts: Zhang (2000), by OpenCV's calibrateCamera.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.calibration.adjustment.adjust import Adjusted, Problem, adjust, minimise
from vidtrack.calibration.adjustment.measurements import PointsOf, SharedPriors, Sights
from vidtrack.calibration.adjustment.unknowns import State, Unknowns, points_of_poses, pose_blocks
from vidtrack.calibration.boards.board import SHAPE, Board
from vidtrack.calibration.boards.board_circles import centroid_shift
from vidtrack.calibration.boards.board_turns import after, inverse
from vidtrack.calibration.camera.refine import POSE, Uncertainty, free_parameters, refine
from vidtrack.geometry.camera import Camera, project
from vidtrack.geometry.jacobian import PARAMETERS


@dataclass(frozen=True)
class BoardSettings:
    """Constants of the adjustment."""

    least_tilt_deg: float = 10.0
    """Angle between the two most different normals below which all views count as parallel."""
    fewest_views: int = 3
    fewest_corners: int = 6
    """Of a view, by all cameras, from which it has a pose."""
    models: tuple[str, ...] = ("tsai", "tsai2", "brown", "prism")
    folds: int = 3
    outlier: float = 4.5
    """Standard deviations of itself beyond which a corner's residual is left out."""
    least_px: float = 0.01
    """Below which no corner's sd goes, whatever the residuals leave: a view seen square on has whole rows of corners
    that lie alike between the pixels, and err together by half as much."""
    rounds: int = 4
    """Times, at most, that corners are left out and the rest fitted again."""
    sure: float = 2.0
    """Standard errors by which a richer lens must predict held-out views better."""
    worth: float = 0.01
    """And the share by which it must."""


SETTINGS = BoardSettings()


class NoLens(ValueError):
    """The views give no lens; the message says why and what to do."""


class BoardFit(NamedTuple):
    """Cameras that see a board: m cameras, n views."""

    cameras: tuple[Camera, ...]
    uncertainties: tuple[Uncertainty, ...]
    covariance: Array  # (K, K) of all cameras' parameters, one camera after the other
    model: str
    poses: Array  # (n, 3, 4) of the board in the world
    shape: Mapping[str, float]
    shape_sd: Mapping[str, float]
    residuals: Array  # (m, n, q, 2) px; NaN where not seen
    sigma_px: float
    factor: float  # by which the corners' stated sd were multiplied
    held_out_px: Mapping[str, float]  # by lens model, of views that the lens has not seen
    converged: bool


def fit_board(
    board: Board, b: Array, sd: Array, sizes: Sequence[tuple[int, int]], world: int, *, model: str = "auto"
) -> BoardFit:
    """The cameras that see a board.

    b      (m, n, q, 2)  px, where camera i sees corner j in view k; NaN where it does not
    sd     (m, n, q)  px
    sizes  px, (width, height) of each camera's pictures
    world  the view whose board is the world
    model  one of LENS_MODELS; auto: the plainest that predicts held-out views as well as any
    Raises NoLens where the views do not determine the lens, or do not connect the cameras.
    """
    starts, poses = _starts(board, b, sizes)
    placed, values = _placed(starts, poses, world)
    values = _nearest(board, b, placed, poses, values, world)
    models = SETTINGS.models if model == "auto" else (model,)
    held_out: dict[str, float] = {}
    taken: tuple[str, Array] | None = None
    raw = b
    if board.type == "circles":
        b = raw - _shift(board, _adjusted(board, raw, sd, placed, values, world, models[0]))
    for each in models if len(models) > 1 or len(b) == 1 else ():
        squares = _held_out(board, b, sd, placed, values, world, each)
        held_out[each] = float(np.sqrt(np.nanmean(squares)))
        if taken is None or _better(taken[1], squares):
            taken = each, squares
    chosen = taken[0] if taken else models[0]
    done = _adjusted(board, b, sd, placed, values, world, chosen)
    for _ in range(SETTINGS.rounds):
        off = np.stack([each.reshape(b.shape[1:]) for each in done.normalised[: len(b)]])
        far = np.nan_to_num(np.abs(off)).max(-1) > SETTINGS.outlier
        if not far.any():
            break
        b = _seen_views(np.where(far[..., None], np.nan, b))  # a corner that is covered in part, or extrapolated
        if not np.isfinite(b[:, world]).any():
            raise NoLens("the view that is the world does not fit the other views: name another one")
        done = _adjusted(board, b, sd, done.state.cameras, done.state.blocks[0], world, chosen)
    if board.type == "circles":  # once more, by the lens that was chosen; a third time changes little
        centred = np.where(np.isfinite(b), raw - _shift(board, done), np.nan)
        done = _adjusted(board, centred, sd, done.state.cameras, done.state.blocks[0], world, chosen)
    return _fitted(board, b, sd, done, chosen, world, held_out)


def _seen_views(b: Array) -> Array:
    """Corners (m, n, q, 2) px, without the views of which so few are left that their pose is unknown."""
    few = np.isfinite(b).all(-1).sum((0, 2)) < SETTINGS.fewest_corners
    return np.where(few[None, :, None, None], np.nan, b)


def _shift(board: Board, done: Adjusted) -> Array:
    """How far the centroids of circles lie from where their centres are seen (m, n, q, 2) px; 0 where unknown."""
    p, _ = board.shaped(dict(done.state.shared))
    poses = done.state.blocks[0]
    each = [centroid_shift(c, poses[..., :3], poses[..., 3], p, board.diameter) for c in done.state.cameras]
    return np.nan_to_num(np.stack(each))


def _starts(board: Board, b: Array, sizes: Sequence[tuple[int, int]]) -> tuple[list[Camera], Array]:
    """A first lens of each camera, and where each sees the board (m, n, 3, 4); NaN where it does not."""
    import cv2

    m, n = b.shape[:2]
    poses = np.full((m, n, 3, 4), np.nan)
    cameras = []
    for i, (width, height) in enumerate(sizes):
        seen = np.isfinite(b[i]).all(-1)
        views = np.flatnonzero(seen.sum(-1) >= 6)
        if len(views) < SETTINGS.fewest_views:
            raise NoLens(f"{len(views)} views of the board; {SETTINGS.fewest_views} are needed, and 20 are good")
        points = [board.corners[seen[k]].astype(np.float32) for k in views]
        corners = [b[i, k, seen[k]].astype(np.float32)[:, None] for k in views]
        K = np.array([[1.2 * width, 0, (width - 1) / 2], [0, 1.2 * width, (height - 1) / 2], [0, 0, 1.0]])
        flags = cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_ASPECT_RATIO
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
        try:
            _, K, _, turns, shifts = cv2.calibrateCamera(points, corners, (width, height), K, np.zeros(5), flags=flags)
        except cv2.error as error:
            raise NoLens(f"the views make no lens ({str(error).splitlines()[-1][:60]})") from None
        normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
        spread = np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1, 1)))
        if spread < SETTINGS.least_tilt_deg:
            raise NoLens(
                f"all {len(views)} views are parallel to within {spread:.0f} deg: the focal length cannot be separated "
                "from the distance. Tilt the board by 20 to 45 deg, to all sides"
            )
        cameras.append(
            Camera(
                float(K[0, 2]),
                float(K[1, 2]),
                1.0,
                1.0,
                1.0,
                float(K[1, 1]),
                0.0,
                np.eye(3),
                np.zeros(3),
                (width, height),
            )
        )
        for k, turn, shift in zip(views, turns, shifts, strict=True):
            poses[i, k, :, :3], poses[i, k, :, 3] = cv2.Rodrigues(turn)[0], shift[:, 0]
    return cameras, poses


def _placed(cameras: Sequence[Camera], poses: Array, world: int) -> tuple[list[Camera], Array]:
    """The cameras in the world of one view, and every view's board there (n, 3, 4). NoLens where they share none."""
    m, n = poses.shape[:2]
    seen = np.isfinite(poses[:, :, 0, 0])
    values = np.full((n, 3, 4), np.nan)
    values[world] = np.eye(3, 4)
    placed: dict[int, Camera] = {}
    while len(placed) < m:
        known = np.isfinite(values[:, 0, 0])
        shared = {i: int((seen[i] & known).sum()) for i in range(m) if i not in placed}
        i = max(shared, key=lambda each: shared[each])
        if not shared[i]:
            raise NoLens(f"camera number {i + 1} shares no view of the board with the others")
        options = [after(poses[i, k], inverse(values[k])) for k in np.flatnonzero(seen[i] & known)]
        centres = np.array([-o[:, :3].T @ o[:, 3] for o in options])
        middle = options[int(np.linalg.norm(centres - np.median(centres, 0), axis=-1).argmin())]
        placed[i] = cameras[i].with_(R=middle[:, :3], T=middle[:, 3])
        for k in np.flatnonzero(seen[i] & ~known):
            values[k] = after(inverse(middle), poses[i, k])
    return [placed[i] for i in range(m)], values


def _nearest(board: Board, b: Array, cameras: Sequence[Camera], poses: Array, values: Array, world: int) -> Array:
    """For each view the pose, of those that each camera alone gives it, that all cameras see best (n, 3, 4).

    A flat board of which a camera sees a few corners has two poses about as likely, and the wrong one may be its own.
    """
    if len(cameras) == 1:
        return values
    best = values.copy()
    for k in range(len(values)):
        own = [after(inverse(_pose(c)), poses[i, k]) for i, c in enumerate(cameras) if np.isfinite(poses[i, k, 0, 0])]
        options = [values[k], *own] if k != world else [values[k]]
        off = []
        for pose in options:
            p = board.corners @ pose[:, :3].T + pose[:, 3]
            squares = [
                ((project(c, p) - b[i, k]) ** 2).sum(-1)[np.isfinite(b[i, k, :, 0])] for i, c in enumerate(cameras)
            ]
            off.append(float(np.nan_to_num(np.concatenate(squares), nan=1e12).sum()))
        best[k] = options[int(np.argmin(off))]
    return best


def _pose(camera: Camera) -> Array:
    return np.concatenate([camera.R, camera.T[:, None]], -1)


def _problem(
    board: Board, b: Array, sd: Array, values: Array, world: int, model: str, views: NDArray[np.intp]
) -> Problem:
    """What is minimised over some of the views (indices); the world's pose is held."""
    m = len(b)
    information = np.zeros((len(views), 6))
    information[views == world] = np.inf
    information[~np.isfinite(b[:, views]).any((0, 2, 3))] = np.inf  # a view of which nothing is left
    family = pose_blocks(len(views))._replace(information=information)

    def points(state: State) -> PointsOf:
        p, by = board.shaped(dict(state.shared))
        poses = state.blocks[0]
        where, J = points_of_poses(poses, p)
        return PointsOf(where, J, {name: by[name] @ poses[..., :3].swapaxes(-1, -2) for name in SHAPE})

    unknowns = Unknowns([free_parameters(model)] * m, values[views][:, :, 3].mean(0), SHAPE)
    sights = [Sights(i, b[i, views], sd[i, views, :, None], points=points) for i in range(m)]
    least = SETTINGS.least_px / float(np.median(sd[np.isfinite(b).all(-1)]))
    return Problem(unknowns, [family], [*sights, SharedPriors(board.shape_priors)], {"px": least})


def _start(cameras: Sequence[Camera], values: Array) -> State:
    return State(tuple(cameras), dict.fromkeys(SHAPE, 0.0), (values,))


def _adjusted(
    board: Board, b: Array, sd: Array, cameras: Sequence[Camera], values: Array, world: int, model: str
) -> Adjusted:
    problem = _problem(board, b, sd, values, world, model, np.arange(len(values)))
    try:
        return adjust(problem, _start(cameras, values), max_steps=60)
    except ValueError as error:
        raise NoLens(f"the views do not settle the lens ({error}). Add views, tilted, in every corner") from None


def _held_out(
    board: Board, b: Array, sd: Array, cameras: Sequence[Camera], values: Array, world: int, model: str
) -> Array:
    """Squared distances (m, n), px^2, of views from cameras that have not seen them: the pose alone is fitted."""
    n = len(values)
    squares = np.full(b.shape[:2], np.nan)
    fold = np.random.default_rng(0).permutation(n) % SETTINGS.folds
    for k in range(SETTINGS.folds):
        kept = np.flatnonzero((fold != k) | (np.arange(n) == world))
        problem = _problem(board, b, sd, values, world, model, kept)
        try:
            done = minimise(problem, _start(cameras, values[kept]), max_steps=20, tolerance=1e-5)
        except ValueError:
            return np.full(b.shape[:2], np.inf)
        p, _ = board.shaped(dict(done.shared))
        for i, camera in enumerate(done.cameras):
            for view in np.flatnonzero(fold == k):
                seen = np.isfinite(b[i, view]).all(-1)
                if seen.sum() < 6 or view == world:
                    continue
                pose = values[view]
                there = camera.with_(R=camera.R @ pose[:, :3], T=camera.R @ pose[:, 3] + camera.T)
                fit = refine(there, p[seen], b[i, view, seen], free=POSE, max_iterations=8, tolerance=1e-4)
                squares[i, view] = (fit.residuals**2).sum(-1).mean()
    return squares


def _better(taken: Array, squares: Array) -> bool:
    both = np.isfinite(taken) & np.isfinite(squares)
    if not np.isfinite(squares[np.isfinite(taken)]).all() or both.sum() < 3:
        return False
    gain = (taken - squares)[both]
    mean, error = gain.mean(), gain.std(ddof=1) / np.sqrt(len(gain))
    return bool(mean > SETTINGS.sure * error and mean > SETTINGS.worth * taken[both].mean())


def _fitted(
    board: Board, b: Array, sd: Array, done: Adjusted, model: str, world: int, held_out: Mapping[str, float]
) -> BoardFit:
    m, n, q = b.shape[:3]
    cameras = done.state.cameras
    names = tuple(name for name in PARAMETERS if name in free_parameters(model))
    k = len(names)
    pivot = done.state.blocks[0][:, :, 3].mean(0)
    uncertainties = tuple(
        Uncertainty(names, pivot, done.covariance[i * k : (i + 1) * k, i * k : (i + 1) * k]) for i in range(m)
    )
    residuals = np.stack([done.residuals[i].reshape(n, q, 2) for i in range(m)])
    shape_sd = np.sqrt(np.diag(done.covariance)[m * k :])
    factor = float(done.factors["px"])
    seen = np.isfinite(residuals).all(-1)
    return BoardFit(
        cameras,
        uncertainties,
        done.covariance[: m * k, : m * k],
        model,
        done.state.blocks[0],
        {name: done.state.shared[name] for name in SHAPE},
        dict(zip(SHAPE, shape_sd.tolist(), strict=True)),
        residuals,
        float(np.sqrt(np.mean(np.broadcast_to(sd * factor, seen.shape)[seen] ** 2))),
        factor,
        held_out,
        done.converged,
    )


def seen_corners(board: Board, fit: BoardFit) -> Array:
    """World positions (n, q, 3) of the corners of every view."""
    p, _ = board.shaped(dict(fit.shape))
    return points_of_poses(fit.poses, p)[0]

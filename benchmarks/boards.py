"""Lenses from a board: errors beside the least that is possible and beside OpenCV's on the same corners; real boards.

    python benchmarks/boards.py accuracy --seeds 20       40 views of a ChArUco board, 0.1 px on every corner
    python benchmarks/boards.py real FOLDER 10x7 24.23    stills of a real checkerboard: squares, side of one
    python benchmarks/boards.py gamma                     corners of rendered boards where levels are light^(1/2.2)
    python benchmarks/boards.py balls                     the same of balls' centroids
    python benchmarks/boards.py tied --seeds 5            cameras tied by a board beside a survey, and without the board
    python benchmarks/boards.py drone FOLDER              X_UASDemoData of the CIRN toolbox: 5 points, known lens

Accuracy: two ways of filming. `filled`: the board is brought to every part of the picture at a third to nearly all of
its height, tilted by 20 to 45 degrees to all sides, as docs/boards.md asks; `middle`: about the middle, farther away
and less tilted. The bound is that of Cramer and Rao for the parameters that were estimated, at the true values.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_circles import centroid_shift
from vidtrack.calibration.boards.board_corners import board_seen
from vidtrack.calibration.boards.board_fit import fit_board
from vidtrack.geometry.camera import Camera, project

BOARD = Board("charuco", 9, 7, 30.0)
SIZE = (1280, 720)
F = 1400.0
TRUE = Camera(655.3, 350.2, 1, 1, 1.001, F, -0.08 / F**2, np.eye(3), np.zeros(3), SIZE)
NOISE = 0.1
VIEWS = 40


def filmed(way: str, rng: np.random.Generator) -> Array:
    """Where the camera sees the corners in VIEWS views (1, n, q, 2) px; NaN outside the picture."""
    p = BOARD.corners - BOARD.corners.mean(0)
    b = np.full((1, VIEWS, len(p), 2), np.nan)
    for k in range(VIEWS):
        while True:
            across, around = rng.uniform(0, 2 * np.pi, 2)
            tilt = np.radians(rng.uniform(20, 45)) if way == "filled" else rng.normal(0, 0.25)
            axis = np.array([np.cos(across), np.sin(across), 0])
            R = cv2.Rodrigues(tilt * axis)[0] @ cv2.Rodrigues(np.array([0, 0, around / 12]))[0] @ np.diag([1, -1, -1.0])
            depth = rng.uniform(330, 900) if way == "filled" else rng.uniform(700, 1200)
            spread = (np.array(SIZE) / 2 + 60) if way == "filled" else np.array(SIZE) / 6
            aim = rng.uniform(-spread, spread)
            at = project(TRUE, p @ R.T + [*(aim * depth / F), depth])
            inside = (at > 0).all(-1) & (at < np.array(SIZE) - 1).all(-1)
            if inside.sum() >= 12:
                break
        b[0, k] = np.where(inside[:, None], at + rng.normal(0, NOISE, at.shape), np.nan)
    return b


def by_opencv(b: Array, board: Board, size: tuple[int, int]) -> Array:
    """f along Y, Cx, Cy, and the rms that calibrateCamera states."""
    seen = [np.isfinite(view).all(-1) for view in b]
    points = [board.corners[s].astype(np.float32) for s in seen if s.sum() >= 6]
    corners = [view[s].astype(np.float32)[:, None] for view, s in zip(b, seen, strict=True) if s.sum() >= 6]
    rms, K, *_ = cv2.calibrateCamera(points, corners, size, None, None)
    return np.array([K[1, 1], K[0, 2], K[1, 2], rms])


def accuracy(seeds: int) -> None:
    for way in ("filled", "middle"):
        ours, theirs, bounds, models = [], [], [], []
        for seed in range(seeds):
            b = filmed(way, np.random.default_rng(seed))
            fit = fit_board(BOARD, b, np.full(b.shape[:3], NOISE), [SIZE], 0)
            camera, known = fit.cameras[0], fit.uncertainties[0]
            models.append(fit.model)
            sd = dict(zip(known.names, known.standard_errors / fit.factor, strict=True))
            bounds.append([100 * sd["f"] / F, sd["Cx"], sd["Cy"]])
            ours.append([100 * (camera.f / F - 1), camera.Cx - TRUE.Cx, camera.Cy - TRUE.Cy])
            K = by_opencv(b[0], BOARD, SIZE)
            theirs.append([100 * (K[0] / F - 1), K[1] - TRUE.Cx, K[2] - TRUE.Cy])
        chosen = ", ".join(f"{name} {models.count(name)}" for name in sorted(set(models)))
        print(f"{way}: {seeds} sets of {VIEWS} views; models: {chosen}")
        print("                     f, %    Cx, px   Cy, px     largest f, Cx, Cy")
        for name, each in (("vidtrack", ours), ("OpenCV", theirs), ("bound", bounds)):
            rms, most = np.sqrt(np.mean(np.square(each), 0)), np.abs(each).max(0)
            print(
                f"  {name:16s} {rms[0]:8.4f} {rms[1]:8.3f} {rms[2]:8.3f}     {most[0]:.4f} {most[1]:.3f} {most[2]:.3f}"
            )
        z = np.sqrt(np.mean(np.square(np.array(ours) / np.array(bounds)), 0))
        share = (np.abs(np.array(ours)[:, 1:]) <= 0.5).all(1).mean()
        print(f"  over the bound   {z[0]:8.3f} {z[1]:8.3f} {z[2]:8.3f}     centre within 0.5 px: {100 * share:.0f} %")


def real(folder: Path, board: Board) -> None:
    """Stills of one board: ours and OpenCV's on our corners, and both on views that neither has seen."""
    pictures = [
        cv2.imread(str(path), 0) for path in sorted(folder.iterdir()) if path.suffix.lower() in (".jpg", ".png")
    ]
    pictures = [picture for picture in pictures if picture is not None]
    size = pictures[0].shape[::-1]
    b = np.full((1, len(pictures), len(board.corners), 2), np.nan)
    sd = np.full(b.shape[:3], np.nan)
    for k, picture in enumerate(pictures):
        if (seen := board_seen(board, picture)) is not None:
            b[0, k, seen.ids], sd[0, k, seen.ids] = seen.b, seen.sd
    kept = np.isfinite(b[0, ..., 0]).any(-1)
    b, sd = b[:, kept], sd[:, kept]
    fit = fit_board(board, b, sd, [size], 0)
    camera, known = fit.cameras[0], fit.uncertainties[0]
    se = dict(zip(known.names, known.standard_errors.tolist(), strict=True))
    left = fit.residuals[0]
    seen_all = np.isfinite(left).all(-1)
    rms = float(np.sqrt((left[seen_all] ** 2).sum(-1).mean()))
    print(f"{folder.name}: {kept.sum()} of {len(pictures)} pictures show it, {size[0]} x {size[1]} px")
    print(
        f"  vidtrack {fit.model}: f {camera.f:.2f} +- {se['f']:.2f}, centre ({camera.Cx:.2f} +- {se['Cx']:.2f}, "
        f"{camera.Cy:.2f} +- {se['Cy']:.2f}), rms {rms:.3f} px, shape "
        + ", ".join(f"{name} {value:.2g} +- {fit.shape_sd[name]:.1g}" for name, value in fit.shape.items())
    )
    K = by_opencv(b[0], board, size)
    print(f"  OpenCV on the same corners: f {K[0]:.2f}, centre ({K[1]:.2f}, {K[2]:.2f}), rms {K[3]:.3f} px")
    print(f"  held-out views, px: {', '.join(f'{name} {value:.3f}' for name, value in fit.held_out_px.items())}")


def gamma(power: float = 1 / 2.2) -> None:
    """How far corners and circles lie from where the camera puts them, levels as light and as light^power."""
    from vidtrack.simulate.board_picture import board_picture, drawing

    camera = Camera(239.3, 181.2, 1, 1, 1.0, 520.0, -0.05 / 520**2, np.eye(3), np.zeros(3), (480, 360))
    print("                 rms of corners, px      along the line from the board's middle, px (a scale)")
    for kind, columns, rows in (("charuco", 8, 6), ("checkerboard", 8, 5), ("circles", 7, 5), ("apriltag", 6, 4)):
        board, bitmap = Board(kind, columns, rows, 30.0), drawing(kind, columns, rows)
        errors: dict[str, list[Array]] = {"light": [], "gamma": []}
        out: dict[str, list[float]] = {"light": [], "gamma": []}
        rng = np.random.default_rng(0)
        for _ in range(5):
            R = cv2.Rodrigues(rng.normal(0, 0.3, 3) * [1, 1, 0.3])[0] @ np.diag([1, -1, -1.0])
            T = np.array([*rng.uniform(-20, 20, 2), 560.0]) - R @ [15.0 * columns, 15.0 * rows, 0]
            p = board.corners @ R.T + T
            truth = project(camera, p)
            if kind == "circles":
                truth = truth + centroid_shift(camera, R[None], T[None], board.corners, board.diameter)[0]
            picture = board_picture(camera, R, T, bitmap, 30.0, noise=0.5, rng=rng)
            bent = np.rint(255 * (picture / 255.0) ** power).astype(np.uint8)
            for name, each in (("light", picture), ("gamma", bent)):
                seen = board_seen(board, each)
                if seen is None:
                    continue
                off = min((seen.b - truth[ids] for ids in (seen.ids, len(truth) - 1 - seen.ids)), key=np.linalg.norm)
                if kind == "apriltag":
                    off = seen.b - truth[seen.ids]
                at = seen.b - seen.b.mean(0)
                errors[name].append(off)
                if kind == "apriltag":  # from each tag's own middle
                    middle = np.array([seen.b[seen.ids // 4 == k].mean(0) for k in seen.ids // 4])
                    at = seen.b - middle
                out[name].append(float((off * at).sum() / np.linalg.norm(at, axis=-1).sum()))
        line = [f"{name} {np.sqrt(np.mean(np.concatenate(each) ** 2)):.3f}" for name, each in errors.items()]
        print(f"  {kind:14s} {', '.join(line)}    {', '.join(f'{n} {np.mean(v):+.3f}' for n, v in out.items())}")


def balls() -> None:
    """Centroids of discs, blurred by 0.7 px, levels as light and as light^(1/2.2): even, and lit from one side."""
    from vidtrack.tracking.detection.blobs import find_blobs

    fine, size = 8, 48
    at = (np.arange(size * fine) + 0.5) / fine - 0.5
    for side in (0.0, 0.1):
        for radius in (3, 5, 8):
            off: dict[float, list[float]] = {1.0: [], 2.2: []}
            rng = np.random.default_rng(0)
            for _ in range(30):
                c = size / 2 + rng.uniform(-0.5, 0.5, 2)
                x, y = at[None] - c[0], at[:, None] - c[1]
                light = np.where(x**2 + y**2 < radius**2, 0.7 * (1 + side * x / radius), 0.1)
                light = cv2.GaussianBlur(light, (0, 0), 0.7 * fine)
                light = light.reshape(size, fine, size, fine).mean((1, 3))
                for gamma, own in off.items():
                    found = find_blobs(np.rint(255 * light ** (1 / gamma)).astype(np.uint8))
                    own.append(float(found.Xf[np.argmax(found.pixels)] - c[0]))
            line = ", ".join(f"gamma {gamma:g} {np.mean(own):+.4f} +- {np.std(own):.4f}" for gamma, own in off.items())
            print(f"  radius {radius} px, lit from one side by {100 * side:.0f} %: {line} px")


def tied(seeds: int) -> None:
    """Two cameras, 16 points surveyed to 0.5 mm, and a board of 24 views before both: 50 other points located."""
    from scipy.spatial.transform import Rotation

    from vidtrack.calibration.adjustment.tied_cameras import TiedCameras
    from vidtrack.calibration.bundle import bundle
    from vidtrack.geometry.triangulate import locate_points

    second = cv2.Rodrigues(np.array([0, 0.35, 0.0]))[0]
    true = [TRUE, TRUE.with_(R=second, T=np.array([-350.0, 0, 60.0]))]
    found: dict[str, list[float]] = {"survey alone": [], "with the board": [], "floor": []}
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        b = np.full((2, 24, len(BOARD.corners), 2), np.nan)
        for k in range(24):
            R = cv2.Rodrigues(rng.normal(0, 0.4, 3) * [1, 1, 2])[0] @ np.diag([1, -1, -1.0])
            x = (BOARD.corners - BOARD.corners.mean(0)) @ R.T + rng.uniform([-150, -80, 450], [300, 80, 900])
            for i, camera in enumerate(true):
                at = project(camera, x)
                inside = (at > 0).all(-1) & (at < np.array(SIZE) - 1).all(-1)
                b[i, k] = np.where(inside[:, None], at + rng.normal(0, NOISE, at.shape), np.nan)
        fit = fit_board(BOARD, b, np.full(b.shape[:3], NOISE), [SIZE] * 2, 0, model="tsai")
        tie = TiedCameras(fit.cameras, [u.names for u in fit.uncertainties], fit.uncertainties[0].pivot, fit.covariance)
        free = [fit.uncertainties[0].names] * 2
        p = rng.uniform([-120, -80, 550], [260, 80, 850], (16, 3))
        survey = p + rng.normal(0, 0.5, p.shape)
        sights = np.stack([project(c, p) + rng.normal(0, NOISE, (16, 2)) for c in true])
        where = rng.uniform([-100, -60, 600], [250, 60, 800], (50, 3))
        clean = [project(c, where) + rng.normal(0, NOISE, (50, 2)) for c in true]
        for word, ties in (("survey alone", ()), ("with the board", (tie,))):
            done = bundle(true, survey, sights, sigma=0.5, free=free, sd=NOISE, tied=ties)
            found[word].append(_beyond_motion(locate_points(done.cameras, np.stack(clean)).point, where, Rotation))
        found["floor"].append(_beyond_motion(locate_points(true, np.stack(clean)).point, where, Rotation))
    for word, each in found.items():
        print(f"  {word:16s} {np.mean(each):.3f} mm beyond a rigid motion, mean over {seeds} sets")


def _beyond_motion(located: Array, true: Array, rotation: Any) -> float:
    """Mean distance after the best rigid motion."""
    a, b = located - located.mean(0), true - true.mean(0)
    turn, _ = rotation.align_vectors(b, a)
    return float(np.linalg.norm(turn.apply(a) - b, axis=-1).mean())


def drone(folder: Path) -> None:
    """Five control points and the lens of the toolbox's calibration, beside its own solution for the camera's place."""
    from scipy.io import loadmat

    from vidtrack.calibration.camera.known_lens import KnownLens, placed
    from vidtrack.geometry.brown import BrownLens
    from vidtrack.geometry.jacobian import position_covariance
    from vidtrack.geometry.lens_conversion import camera_from_brown

    inside = folder / "extrinsicsIntrinsics"

    def mat(name: str) -> dict[str, Array]:
        return loadmat(str(inside / name), squeeze_me=True, struct_as_record=False)

    io = mat("IntrinsicCalculations/uasDemo_IO.mat")["intrinsics"]
    lens = BrownLens(io[4], io[5], io[2] - 1, io[3] - 1, (int(io[0]), int(io[1])), tuple(io[6:9]), io[9], io[10])
    p = np.loadtxt(inside / "uasDemoFlight_NCSP_GCPS.txt", delimiter=",")[:, 1:]
    b = np.array([own.UVd for own in mat("InitialValues/uasDemo_gcpUVdInitial.mat")["gcp"]]) - 1
    theirs = mat("InitialValues/uasDemo_IOEOInitial.mat")["extrinsics"][:3]
    converted = camera_from_brown(lens)
    known = KnownLens(converted.camera, converted.model)
    print(f"lens: {converted.model}, {converted.largest_px:.2f} px off the Brown lens at most")
    for left_out in (None, *range(len(p))):
        kept = np.arange(len(p)) != left_out
        fit = placed(known, p[kept], b[kept], np.ones((kept.sum(), 2)), None).fit
        off = np.linalg.norm(fit.camera.position - theirs)
        if left_out is None:
            C = position_covariance(
                fit.camera, fit.uncertainty.names, fit.uncertainty.pivot, fit.uncertainty.covariance
            )
            rms = np.sqrt((fit.residuals**2).sum(-1).mean())
            sigma = np.sqrt(np.diag(C)).round(2).tolist()
            print(f"{kept.sum()} points: {off:.3f} m from the toolbox's place, sigma {sigma} m, rms {rms:.2f} px")
        else:
            miss = np.linalg.norm(project(fit.camera, p[left_out]) - b[left_out])
            print(f"without point {left_out + 1}: {off:.3f} m; that point is predicted to {miss:.1f} px")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("accuracy").add_argument("--seeds", type=int, default=20)
    own = commands.add_parser("real")
    own.add_argument("folder", type=Path)
    own.add_argument("squares", help="as 10x7: columns and rows of squares")
    own.add_argument("square", type=float)
    own.add_argument("--type", default="checkerboard")
    commands.add_parser("gamma")
    commands.add_parser("balls")
    commands.add_parser("tied").add_argument("--seeds", type=int, default=5)
    commands.add_parser("drone").add_argument("folder", type=Path)
    asked = parser.parse_args()
    if asked.command == "accuracy":
        accuracy(asked.seeds)
    elif asked.command == "gamma":
        gamma()
    elif asked.command == "balls":
        balls()
    elif asked.command == "tied":
        tied(asked.seeds)
    elif asked.command == "drone":
        drone(asked.folder)
    else:
        columns, rows = map(int, asked.squares.split("x"))
        real(asked.folder, Board(asked.type, columns, rows, asked.square))


if __name__ == "__main__":
    main()

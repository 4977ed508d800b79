"""What the views of a board say against the board, the lens, or the way in which it was filmed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_fit import BoardFit, seen_corners
from vidtrack.calibration.camera.gates import hull_area
from vidtrack.findings import Finding
from vidtrack.geometry.camera import project


@dataclass(frozen=True)
class DoubtSettings:
    """Limits."""

    bent: float = 4.0
    """Standard deviations of what a board's shape is known by beforehand, from which it is called bent."""
    rough_px: float = 0.5
    """px of residuals from which the board, its numbers or the picture are in doubt: corners are good to a tenth."""
    covered: float = 0.3
    """Share of the picture that the corners of all views should cover."""
    f_sd: float = 0.005
    """Share of f that its standard error may be."""
    outward_px: float = 0.05
    """px by which corners of dark tags may lie inwards or outwards: a camera's gamma draws them inwards by 0.15."""


SETTINGS = DoubtSettings()


def board_doubts(name: str, board: Board, fit: BoardFit, row: int, size: tuple[int, int], units: str) -> list[Finding]:
    """What the views say against the board, the lens or the way it was filmed."""
    where, findings = f"cameras.{name}", []
    left = fit.residuals[row]
    seen = np.isfinite(left).all(-1)
    rms = float(np.sqrt((left[seen] ** 2).sum(-1).mean() / 2))
    if not fit.converged:
        text = f"{where}: the adjustment of the board's views did not converge."
        findings.append(Finding("doubtful", "board-not-converged", text, "Add sharp views, tilted to all sides."))
    if rms > SETTINGS.rough_px:
        text = f"{where}: the corners lie {rms:.2g} px from where board and lens put them; 0.1 px is usual."
        cure = "Is it one flat board, are columns, rows, square and marker right, and are the pictures sharp?"
        findings.append(Finding("doubtful", "board-rough", text, cure))
    for shape, value in fit.shape.items():
        sd = board.shape_priors[shape][1]
        if row == 0 and abs(value) > SETTINGS.bent * sd:
            size_text = f"{abs(value):.2g} {units}" if shape != "stretch" else f"{100 * abs(value):.2g} %"
            text = f"{where}: the board is bent or scaled unevenly ({shape} {size_text})."
            findings.append(Finding("doubtful", "board-bent", text, "Glue it to a flat plate; measure both its sides."))
            break
    width, height = size
    corners = predicted(fit, row, board)[seen]
    share = hull_area(corners) / (width * height)
    if share < SETTINGS.covered:
        text = f"{where}: the board was in {100 * share:.0f} % of the picture only; beyond it the lens is extrapolated."
        findings.append(Finding("doubtful", "board-in-a-corner", text, "Show it in every corner of the picture."))
    sd_f = dict(zip(fit.uncertainties[row].names, fit.uncertainties[row].standard_errors.tolist(), strict=True))["f"]
    if sd_f > SETTINGS.f_sd * fit.cameras[row].f:
        text = f"{where}: the views leave f +- {100 * sd_f / fit.cameras[row].f:.1f} %."
        findings.append(Finding("doubtful", "board-views-poor", text, "Tilt the board by 20 to 45 deg, to all sides."))
    if board.type == "apriltag" and abs(out := _outward(fit, row, board)) > SETTINGS.outward_px:
        text = (
            f"{where}: the tags look {'smaller' if out < 0 else 'larger'} than they are: their corners lie "
            f"{abs(out):.2g} px from where the board has them, towards or from each tag's own middle. The lens hardly "
            "depends on it, the distance of a single tag does."
        )
        cure = "Measure marker again; switch the camera's gamma off, or film sharper and darker."
        findings.append(Finding("note", "board-tags-shrunk", text, cure))
    return findings


def _outward(fit: BoardFit, row: int, board: Board) -> float:
    """By how much (px, mean) corners of tags lie farther from the middle of their own tag than they should."""
    b = predicted(fit, row, board)
    n = len(b)
    each = b.reshape(n, -1, 4, 2)
    out = (each - each.mean(2, keepdims=True)).reshape(n, -1, 2)
    along = (fit.residuals[row] * out).sum(-1) / np.linalg.norm(out, axis=-1)
    return float(np.nanmean(along)) if np.isfinite(along).any() else 0.0


def predicted(fit: BoardFit, row: int, board: Board) -> Array:
    """Where camera `row` sees every corner (n, q, 2) px."""
    return project(fit.cameras[row], seen_corners(board, fit))

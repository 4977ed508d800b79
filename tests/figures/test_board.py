"""A board on paper: true to scale, with what to check it by."""

import cv2
import numpy as np
from click.testing import CliRunner

from vidtrack.calibration.boards.board import Board
from vidtrack.calibration.boards.board_corners import board_seen
from vidtrack.commands.plan import command
from vidtrack.figures.board import EDGE_MM, FOOT_MM, board_sheet
from vidtrack.simulate.board_picture import MARGIN, PER_SQUARE, drawing


def test_the_printed_corners_are_a_square_apart():
    """Rendered at 8 px a mm: corners of 25 mm squares lie 200 px apart, to a tenth of a mm."""
    edge = round(MARGIN * PER_SQUARE)
    figure = board_sheet(drawing("charuco", 6, 5)[edge:-edge, edge:-edge], 150.0, 125.0, "six by five")
    figure.set_dpi(8 * 25.4)
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    grey = cv2.cvtColor(np.asarray(canvas.buffer_rgba())[..., :3].copy(), cv2.COLOR_RGB2GRAY)
    assert abs(grey.shape[1] / 8 - (150 + 2 * EDGE_MM)) < 1
    assert abs(grey.shape[0] / 8 - (125 + EDGE_MM + FOOT_MM)) < 1
    seen = board_seen(Board("charuco", 6, 5, 25.0), grey)
    b = seen.b[np.argsort(seen.ids)].reshape(4, 5, 2)
    np.testing.assert_allclose(np.linalg.norm(np.diff(b, axis=1), axis=-1), 200, atol=0.8)


def test_plan_board_writes_a_pdf_and_says_what_to_do(tmp_path):
    answer = CliRunner().invoke(command, ["board", str(tmp_path / "b.pdf"), "--columns", "5", "--rows", "4"])
    assert answer.exit_code == 0, answer.output
    assert (tmp_path / "b.pdf").read_bytes().startswith(b"%PDF")
    assert "100 %" in answer.output

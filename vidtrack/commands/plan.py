"""vidtrack plan."""

from __future__ import annotations

import os

import click

_EXAMPLES = """
\b
Examples:
  vidtrack plan thesis predicted      the rig of the thesis, which comes with
                                      vidtrack (data/sensitivity/thesis.yaml)
  vidtrack plan my-rig.yaml predicted
  vidtrack plan board board.pdf --columns 8 --rows 6 --square 30
                                      a calibration board to print
"""


@click.command("plan", epilog=_EXAMPLES)
@click.argument("plan", type=click.Path(dir_okay=False))
@click.argument("folder", type=click.Path())
@click.option(
    "--type", "kind", metavar="TYPE", default="charuco", help="Of board: charuco, checkerboard, circles or apriltag."
)
@click.option("--columns", metavar="N", default=8, show_default=True, help="Of board: squares in a row.")
@click.option("--rows", metavar="N", default=6, show_default=True, help="Of board: squares in a column.")
@click.option("--square", metavar="MM", default=30.0, show_default=True, help="Of board: mm, side of a square.")
def command(plan: str, folder: str, kind: str, columns: int, rows: int, square: float) -> int:
    """Predict what accuracy the rig of a PLAN will have, and write tables and figures to FOLDER.

    Of the word board: write a calibration board to the PDF file FOLDER, at true scale.
    """
    if plan == "board":
        return _board(folder, kind, columns, rows, square)
    from vidtrack.jobs.sensitivity import main as predict
    from vidtrack.workflow.shipped import PLANS, example_or_file

    return predict([example_or_file(plan, PLANS), folder])


def _board(path: str, kind: str, columns: int, rows: int, square: float) -> int:
    """Write the sheet of a board."""
    from vidtrack.errors import VidtrackError
    from vidtrack.figures.board import board_sheet
    from vidtrack.files.atomic import replacing
    from vidtrack.simulate.board_picture import MARGIN, PER_SQUARE, drawing

    if kind not in ("charuco", "checkerboard", "circles", "apriltag"):
        raise VidtrackError(f"--type {kind}: there are charuco, checkerboard, circles and apriltag.")
    if not path.lower().endswith(".pdf"):
        raise VidtrackError(f"{path}: a board is written as PDF. Name it {os.path.splitext(path)[0]}.pdf.")
    if not (3 <= columns <= 60 and 3 <= rows <= 60 and 1 <= square <= 1000):
        raise VidtrackError("a board has 3 to 60 columns and rows of 1 to 1000 mm.")
    edge = round(MARGIN * PER_SQUARE)
    bitmap = drawing(kind, columns, rows)[edge:-edge, edge:-edge]
    own = (0.5 if kind == "circles" else 0.75) * square  # a circle's diameter, a tag's side
    words = f"type: {kind}, columns: {columns}, rows: {rows}, square: {square:g} mm, marker: {own:g} mm"
    with replacing(path) as file:
        board_sheet(bitmap, columns * square, rows * square, words).savefig(file, format="pdf")
    click.echo(f"{path}: print it at 100 %, measure the ruler, and glue it to a flat plate. {words}")
    return 0

"""Job overlay: a camera's picture and points -> results/calibration/overlay_<camera>.png."""

from __future__ import annotations

from vidtrack.figures.overlay import overlay
from vidtrack.files.figure_files import write_figure
from vidtrack.files.records import read_png
from vidtrack.files.tables import read_parquet
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """inputs: picture, points, table (backprojection.parquet). settings: camera. outputs: overlay."""
    points = read_parquet(job.path("points"))
    table = read_parquet(job.path("table"))
    camera = str(job.settings["camera"])
    drawn = overlay(read_png(job.path("picture")), points, table[table["camera"] == camera], camera)
    write_figure(job.outputs["overlay"], drawn)

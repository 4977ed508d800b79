"""The door of rule overlay: a camera's picture and points in, overlay_<camera>.png out."""

from __future__ import annotations

from vidtrack.figures.overlay import overlay
from vidtrack.files.figure_files import write_figure
from vidtrack.files.records import read_png
from vidtrack.files.tables import read_parquet
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """Draw the overlay of the one camera that the table of points is about."""
    points = read_parquet(job.path("points"))
    table = read_parquet(job.path("table"))
    camera = str(job.settings["camera"])
    write_figure(
        job.outputs["overlay"], overlay(read_png(job.path("picture")), points, table[table["camera"] == camera], camera)
    )

"""The numbers of docs/filming.md are what the simulator gives."""

import re
from pathlib import Path

import pytest

from benchmarks.filming import angle_between, errors, rms

TEXT = (Path(__file__).parents[1] / "docs/filming.md").read_text()


def row(title, below):
    """The numbers of a table: {of its head: of the row under it}."""
    head = re.search(rf"^\| {re.escape(title)}[^|]*\|(.*)\|$", TEXT, re.MULTILINE)[1]
    line = re.search(rf"^\| {re.escape(below)}[^|]*\|(.*)\|$", TEXT[TEXT.index(head) :], re.MULTILINE)[1]
    numbers = ([float(cell.strip(" °")) for cell in part.split("|")] for part in (head, line))
    return dict(zip(*numbers, strict=True))


def test_errors_at_every_angle_between_two_cameras():
    at_right_angles = angle_between(90)
    for k, name in enumerate(("error across", "error in depth")):
        for degrees, share in row("angle between", name).items():
            assert (angle_between(degrees) / at_right_angles)[k] == pytest.approx(share, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("title", "value", "how"),
    [
        ("diameter, px", 3, {"diameter": 3}),
        ("contrast of a target", 30, {"contrast": 30}),
        ("noise, grey levels", 12, {"noise": 12}),
        ("brightest level", 4, {"contrast": 4 * 255 - 24}),
    ],
)
def test_errors_of_centroids_by_size_and_light(title, value, how):
    assert rms(errors(80, **how)).mean() == pytest.approx(row(title, "error")[value], rel=0.25)  # of 160 numbers

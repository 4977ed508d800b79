"""A figure makes the same bytes every time, in a file or inside the page."""

import base64

import pytest

from vidtrack.files.figure_files import data_uri, file_uri, write_figure
from vidtrack.files.records import read_png

matplotlib_figure = pytest.importorskip("matplotlib.figure")


def figure():
    drawn = matplotlib_figure.Figure(figsize=(2, 1), dpi=50)
    drawn.add_subplot().plot([0, 1], [1, 0])
    return drawn


def test_a_figure_is_the_same_file_every_time_and_says_nothing_of_the_program(tmp_path):
    for name in ("a.png", "b.png"):
        write_figure(tmp_path / name, figure())
    data = (tmp_path / "a.png").read_bytes()
    assert data == (tmp_path / "b.png").read_bytes()
    assert b"Matplotlib" not in data
    assert read_png(tmp_path / "a.png").shape[:2] == (50, 100)


def test_a_picture_inside_the_page_is_that_of_the_file(tmp_path):
    write_figure(tmp_path / "a.png", figure())
    uri = file_uri(tmp_path / "a.png")
    assert uri == data_uri(figure())
    head, _, data = uri.partition(",")
    assert head == "data:image/png;base64"
    assert base64.b64decode(data) == (tmp_path / "a.png").read_bytes()


def test_a_figure_that_cannot_be_drawn_leaves_the_old_file(tmp_path):
    (tmp_path / "a.png").write_bytes(b"old")
    broken = figure()
    broken.axes[0].set_xlabel("$\\nonsense{$")
    with pytest.raises(ValueError):
        write_figure(tmp_path / "a.png", broken)
    assert (tmp_path / "a.png").read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]

"""What all figures have in common."""

import warnings
from pathlib import Path

import numpy as np

from vidtrack.figures import style
from vidtrack.figures.style import camera_colours, legend, magnification, new_figure


def test_magnification_is_a_round_number_that_shows_typical_arrows():
    assert magnification([0.1, 0.2, 0.3], 10) == 50
    assert magnification([100.0], 10) == 1
    assert magnification([np.nan], 10) == 1


def test_a_camera_keeps_its_colour_whatever_the_figure():
    assert camera_colours(["a", "b"])["a"] == camera_colours(["a", "b", "c"])["a"]


def test_axes_without_anything_labelled_have_no_legend_and_give_no_warning():
    _figure, ax = new_figure()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        legend(ax, fontsize=7)
        assert ax.get_legend() is None
        ax.plot([0, 1], [0, 1], label="a")
        legend(ax, fontsize=7)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["a"]


def test_no_figure_makes_a_legend_of_its_own():
    for path in Path(style.__file__).parent.glob("*.py"):
        assert path.name == "style.py" or ".legend(" not in path.read_text(), path

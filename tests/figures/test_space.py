"""The still picture of the rig shows each camera by its name, and the target's path."""

import numpy as np
import pytest

from vidtrack.figures.space import TILT, TURN, flat, space

VIEW = {
    "units": "m",
    "points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "hull": [[0, 1], [0, 2]],
    "cameras": [{"name": "cam1", "colour": "red", "centre": [0, -3, 0], "corners": [[0, -2, 0]] * 4}],
    "tracks": [{"colour": "blue", "p": [[0, 0, 0], None, [1, 1, 1]]}],
}


def test_every_part_of_the_view_is_drawn_at_equal_scales():
    (ax,) = space(VIEW, "pluck").axes
    assert [word.text for word in ax.words] == ["cam1", "x", "y", "z"]
    hull, survey, camera, path, arrows = 2, 1, 1 + 4, 1, 3
    assert len(ax.lines) == hull + survey + camera + path + arrows
    assert ax.equal == "limits"
    assert ax.title == "x, y and z at the corner are 0.2 m long"


def test_a_length_across_the_view_is_seen_whole_and_one_along_it_not_at_all():
    right, toward = np.array([np.cos(TURN), np.sin(TURN), 0]), np.array([-np.sin(TURN), np.cos(TURN), 0]) * np.cos(TILT)
    toward[2] = -np.sin(TILT)
    assert flat(right) == pytest.approx([1, 0])
    assert flat(toward) == pytest.approx([0, 0])


def test_an_empty_view_is_an_empty_figure():
    assert space({**VIEW, "points": [], "hull": [], "cameras": [], "tracks": []}, "").axes

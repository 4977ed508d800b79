"""The still picture of the rig shows each camera by its name, and the target's path."""

from vidtrack.figures.space import space

VIEW = {
    "units": "m",
    "points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "hull": [[0, 1], [0, 2]],
    "cameras": [{"name": "cam1", "colour": "red", "centre": [0, -3, 0], "corners": [[0, -2, 0]] * 4}],
    "tracks": [{"colour": "blue", "p": [[0, 0, 0], None, [1, 1, 1]]}],
}


def test_every_part_of_the_view_is_drawn_at_equal_scales():
    (ax,) = space(VIEW, "pluck").axes
    assert [text.get_text().strip() for text in ax.texts] == ["cam1"]
    assert len(ax.lines) == 2 + 1 + 4 + 1
    assert len(ax.collections) == 1
    spans = [high - low for low, high in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())]
    assert max(spans) / min(spans) < 6
    assert ax.get_xlabel() == "x (m)"


def test_an_empty_view_is_an_empty_figure():
    assert space({**VIEW, "points": [], "hull": [], "cameras": [], "tracks": []}, "").axes

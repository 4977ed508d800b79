"""Six panels: five times the points where each says they are, and the residuals with the worst points named."""

import numpy as np
import pandas as pd

from vidtrack.figures.showcalb import showcalb

PLACES = np.array([[100.0, 80.0], [140.0, 90.0], [120.0, 130.0], [160.0, 120.0]])
RESIDUALS = np.array([[0.1, 0.0], [0.0, 0.9], [0.2, 0.0], [0.0, 0.5]])


def drawn(picture=(240, 320)):
    table = pd.DataFrame({"tag": ["a", "b", "c", "d"]})
    for name, off in (("", RESIDUALS), ("_projected", 0.0), ("_no_distortion", 3.0), ("_from_located", 0.05)):
        table[[f"Xf{name}", f"Yf{name}"]] = PLACES + off
    return showcalb(np.full(picture, 90, np.uint8), table, PLACES + 4.0, "cam1")


def test_each_panel_shows_its_own_points():
    axes = drawn().axes
    off = [axes[i].lines[0].get_xydata() - PLACES for i in range(5)]
    assert np.allclose(off[0], RESIDUALS)
    assert np.allclose([o.mean() for o in off[1:]], [0.0, 3.0, 0.05, 4.0])
    assert all(np.ptp(o) < 1e-9 for o in off[1:])


def test_the_worst_points_are_named_worst_first_with_their_residuals():
    ax = drawn().axes[5]
    assert ax.get_xlabel() == "worst: b (0.9 px), d (0.5 px), c (0.2 px)"
    assert [text.get_text() for text in ax.texts] == ["b", "d", "c"]
    (arrows,) = [c for c in ax.collections if hasattr(c, "U")]
    times = float(ax.get_title().split(", ")[1].split()[0])
    assert np.allclose(np.stack([arrows.U, arrows.V], 1), times * RESIDUALS)


def test_the_part_of_the_picture_about_the_points_is_shown():
    ax = drawn().axes[0]
    left, right = ax.get_xlim()
    bottom, top = ax.get_ylim()
    assert left < 100 < 160 < right < 190
    assert top < 80 < 130 < bottom < 160


def test_points_that_were_found_nowhere_leave_the_pictures_empty():
    table = pd.DataFrame({"tag": ["a"]})
    for name in ("", "_projected", "_no_distortion", "_from_located"):
        table[[f"Xf{name}", f"Yf{name}"]] = np.nan
    figure = showcalb(np.zeros((40, 60), np.uint8), table, np.full((1, 2), np.nan), "cam1")
    assert figure.axes[5].get_xlabel() == "worst: "
    assert figure.axes[0].get_xlim() == (-0.5, 59.5)

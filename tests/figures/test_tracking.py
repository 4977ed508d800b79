"""Tracks in the picture, pixel locking, worst samples, the clock search."""

import numpy as np
import pandas as pd
import pytest

from tests.figures.drawn import T, texts
from vidtrack.figures import tracking


def test_tracks_count_what_was_lost():
    table = pd.DataFrame({"time_s": T, "target": "t1", "Xf": np.sin(T), "Yf": np.cos(T)})
    table.loc[:4, ["Xf", "Yf"]] = np.nan
    figure = tracking.tracks({"cam1": table}, {"cam1": "red"}, "run")
    assert any("5 samples lost" in t for t in texts(figure))


def test_the_clocks_curve_is_in_milliseconds():
    clocks = {"cam2": {"offset_s": 0.01, "offsets_s": [0.0, 0.01, 0.02], "error_px": [1.0, 0.1, 1.0]}}
    figure = tracking.clock_search(clocks, {"cam2": "red"})
    assert list(figure.axes[0].lines[0].x) == [0, 10, 20]


def test_pixel_locking_is_shown_times_the_mean_and_a_camera_without_centroids_not_at_all():
    edges = np.linspace(-0.5, 0.5, 5)
    flat, empty = {"counts": [2, 2, 2, 6], "edges": edges}, {"counts": [0] * 4, "edges": edges}
    records = {"a": {"pixel_locking": {"x": flat, "y": flat}}, "b": {"pixel_locking": {"x": empty, "y": empty}}}
    figure = tracking.pixel_locking(records, {"a": "red", "b": "blue"})
    (steps,) = figure.axes[0].lines
    assert steps.y[::2].tolist() == steps.y[1::2].tolist() == pytest.approx([2 / 3, 2 / 3, 2 / 3, 2])
    assert steps.x.tolist() == np.repeat(edges, 2)[1:-1].tolist()
    assert "a" in texts(figure)
    assert "b" not in texts(figure)


def test_the_worst_samples_name_their_frame_target_and_flag():
    picture = np.zeros((9, 9), np.uint8)
    moments = [{"picture": picture, "frame": 12, "target": "t1", "flag": "merged"}]
    moments.append({"picture": picture, "frame": 40, "target": "t2", "flag": ""})
    shown = texts(tracking.worst_moments(moments, "cam1"))
    assert "frame 12\nt1: merged" in shown
    assert "frame 40\nt2: least contrast" in shown


def test_tracks_over_the_picture_dot_what_was_lost():
    rows = pd.DataFrame({"target": "t1", "Xf": np.arange(60.0), "Yf": 5.0})
    rows.loc[10:14, ["Xf", "Yf"]] = np.nan
    figure = tracking.tracks_over_picture(np.full((40, 60), 9.0), rows, "cam1")
    track, gap = figure.axes[0].lines
    assert np.isnan(track.x[12])
    assert gap.x.tolist() == [9, 15]
    assert "cam1: tracks, 1 lost stretches dotted red" in texts(figure)

"""The tables of the track stage."""

from fractions import Fraction

import numpy as np

from tests.lit_balls import noisy, picture
from vidtrack.association.tracklets import COLUMNS
from vidtrack.stages.track import CENTROIDS, track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.windows import COLUMNS as WINDOW_COLUMNS

SHAPE = (60, 90)


def tracked(lamp):
    """A ball that something hides for a while, so that pieces of pictures are kept."""
    rng, frames = np.random.default_rng(2), []
    for k in range(30):
        balls = [] if 12 <= k < 16 else [(25 + 1.3 * k, 30.0, 5.0)]
        luma = noisy(picture(SHAPE, balls, lamp=lamp), rng)
        frames.append(Frame(k, Fraction(k, 25), luma, False, None))
    return track(frames, VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive"), targets=["ball"])


def test_columns_are_those_that_are_named():
    found = tracked((1.0, 0.0, 0.5))
    assert tuple(found.centroids.columns) == CENTROIDS
    assert tuple(found.tracklets.columns) == tuple(COLUMNS)
    assert tuple(found.windows.columns) == WINDOW_COLUMNS
    assert len(found.centroids) == 30
    assert set(found.centroids["target"]) == {"ball"}


def test_pieces_know_how_targets_are_lit():
    lit, plain = (tracked(lamp).windows for lamp in ((1.0, 0.0, 0.5), None))
    assert len(lit)
    assert (lit["lit_x"] < -0.1).all()
    assert (lit["lit_sd"] > 0).all()
    assert not plain[["lit_x", "lit_y", "lit_sd"]].to_numpy().any()

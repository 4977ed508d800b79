"""A view holds the targets' tracks and what else was followed, cut where identity is in doubt."""

import numpy as np
import pandas as pd

from vidtrack.association.tracklets import COLUMNS
from vidtrack.location.view_tables import view_of
from vidtrack.simulate.rig import thesis_rig

CAMERA = thesis_rig(1)[0]


def centroids(flags):
    n = len(flags)
    Xf = np.where([f == "lost" for f in flags], np.nan, 10.0 + np.arange(n))
    return pd.DataFrame({"time_s": np.arange(n) / 30, "target": "t1", "Xf": Xf, "Yf": Xf, "flag": flags})


def tracklets(*rows):
    """Tracklets from (number, target, samples)."""
    table = [
        pd.DataFrame({"tracklet": k, "target": name, "time_s": np.array(samples) / 30, "Xf": 100.0 * k, "Yf": 7.0})
        for k, name, samples in rows
    ]
    return pd.concat(table).reindex(columns=list(COLUMNS))


def test_what_was_followed_besides_the_targets_is_in_tracks_without_a_name():
    others = tracklets((0, "t1", range(8)), (1, "", range(2, 5)), (2, "", range(4, 8)), (3, "", range(7, 10)))
    view = view_of("cam1", centroids([""] * 10), others, CAMERA, None)
    assert view.tracks == ["t1", "", ""]
    assert view.named == ["t1"]
    assert view.n_pieces == 4
    assert np.isfinite(view.b[1:, :, 0]).sum(0).tolist() == [0, 0, 1, 1, 2, 1, 1, 2, 1, 1]
    # one lane holds the first and the third, two moments apart at least
    assert view.piece[1].tolist() == [-1, -1, 1, 1, 1, -1, -1, 2, 2, 2]


def test_a_track_is_cut_where_one_of_its_tracklets_begins():
    cut = tracklets((0, "t1", range(5)), (1, "t1", range(5, 10)))
    assert view_of("cam1", centroids([""] * 10), cut, CAMERA, None).piece[0].tolist() == [0] * 5 + [1] * 5
    assert view_of("cam1", centroids([""] * 10), None, CAMERA, None).piece[0].tolist() == [0] * 10


def test_tracklets_of_two_samples_and_samples_of_no_moment_are_noise():
    few = tracklets((0, "", (3, 4)), (1, "", (5.5, 6.5, 7.5)))
    view = view_of("cam1", centroids([""] * 10), few, CAMERA, None)
    assert view.tracks == ["t1"]
    assert view.n_pieces == 1

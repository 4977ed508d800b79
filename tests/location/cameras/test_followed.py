"""A view holds the targets' tracks and what else was followed, cut where identity is in doubt."""

import numpy as np

from vidtrack.location.cameras.followed import ROWS, Rows, rows_of, view_of
from vidtrack.simulate.rig import thesis_rig

CAMERA = thesis_rig(1)[0]


def rows(samples, target, flags=None, number=-1, Xf=None, bound=False):
    n = len(samples)
    flag = np.array(flags if flags is not None else [""] * n, object)
    b = np.repeat(np.where(flag == "lost", np.nan, 10.0 + np.arange(n) if Xf is None else Xf)[:, None], 2, 1)
    words = np.full(n, "", object)
    named = np.full(n, target, object)
    sd, ball = np.full((n, 2), np.nan), np.full((n, 3), np.nan)
    return Rows(np.array(samples) / 30, named, b, sd, flag, words, np.full(n, number), np.full(n, bound), ball)


def centroids(flags):
    return rows(range(len(flags)), "t1", flags)


def tracklets(*told, bound=False):
    """Tracklets from (number, target, samples)."""
    parts = [rows(samples, name, number=k, Xf=100.0 * k, bound=bound) for k, name, samples in told]
    return Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


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


def test_each_piece_knows_its_tracklet_in_the_table_and_the_name_that_a_start_box_gives_it():
    cut = tracklets((7, "t1", range(5)), (4, "t1", range(5, 10)), (9, "", range(3, 9)))
    view = view_of("cam1", centroids([""] * 10), cut, CAMERA, None)
    assert view.number.tolist() == [7, 4, 9]
    assert view.given == ["", "", ""]
    bound = tracklets((7, "t1", range(5)), bound=True)
    free = tracklets((4, "t1", range(5, 10)))
    both = Rows(*(np.concatenate(column) for column in zip(bound, free, strict=True)))
    assert view_of("cam1", centroids([""] * 10), both, CAMERA, None).given == ["t1", ""]
    alone = view_of("cam1", centroids([""] * 10), None, CAMERA, None)
    assert alone.number.tolist() == [-1]
    assert alone.given == [""]


def test_rows_without_a_time_are_none_and_a_deviation_that_is_not_above_0_is_not_known():
    columns = {
        name: np.array(values)
        for name, values in {
            "time_s": [0.0, np.nan, 0.1, 0.2],
            "target": ["a"] * 4,
            "Xf": [1.0] * 4,
            "Yf": [2.0] * 4,
            "sd_x": [0.02, 0.02, 0.0, 0.04],
            "sd_y": [0.02, 0.02, -1.0, 0.04],
        }.items()
    }
    seen = rows_of(columns)
    assert seen.time.tolist() == [0.0, 0.1, 0.2]
    view = view_of("cam1", seen, None, thesis_rig(2)[0], None)
    assert view.sd[0].tolist() == [[0.02, 0.02], [0.03, 0.03], [0.04, 0.04]]
    never = view_of("cam1", rows_of(columns | {"sd_x": np.zeros(4), "sd_y": np.zeros(4)}), None, thesis_rig(2)[0], None)
    assert not never.has_sd
    assert (never.sd > 0).all()


def test_no_other_columns_are_read_than_those_that_are_named():
    asked = set()

    class Named(dict):
        def __contains__(self, name):
            asked.add(name)
            return super().__contains__(name)

        def __getitem__(self, name):
            asked.add(name)
            return super().__getitem__(name)

        def get(self, name, otherwise=None):
            asked.add(name)
            return super().get(name, otherwise)

    table = Named({name: np.arange(3.0) for name in ROWS})
    rows_of(table)
    assert asked == set(ROWS)

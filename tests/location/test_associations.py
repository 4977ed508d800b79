"""The table of tracklets says of which target each is, how surely, and what the next best choice was."""

import numpy as np

from tests.location.one_camera.test_in_picture import exchanged
from vidtrack.location.associations import COLUMNS, association_columns
from vidtrack.location.one_camera.in_picture import followed_in_picture


def test_each_tracklet_has_its_target_its_partner_and_the_runner_up():
    view, _, hidden = exchanged(np.random.default_rng(0))
    found = followed_in_picture(view, None, 2, whole=True)
    told = association_columns([view], found.match)
    assert list(told) == list(COLUMNS)
    by_number = {int(n): k for k, n in enumerate(told["tracklet"])}
    assert [told["target"][by_number[n]] for n in range(4)] == ["a", "b", "b", "a"]
    assert [told["track"][by_number[n]] for n in range(4)] == ["a", "a", "b", "b"]
    joined = {told["tracklet"][k]: told["joined_with"][k] for k in range(4) if told["joined_with"][k]}
    pairs = {0: "cam1:3", 3: "cam1:0", 1: "cam1:2", 2: "cam1:1"}
    assert len(joined) == 2
    assert all(pairs[n] == other for n, other in joined.items())
    own = np.array([told["joined_with"][k] != "" for k in range(4)])
    assert (told["odds"][own] > 1000).all()
    assert np.isnan(told["odds"][~own]).all()
    first = np.flatnonzero(hidden)[0]
    assert told["end_s"][by_number[0]] == view.t[first - 1]
    assert told["samples"].sum() == 2 * (~hidden).sum()
    assert (told["reason"] == "").all()


def test_what_is_of_no_target_has_its_reason():
    view, _, _ = exchanged(np.random.default_rng(0))
    told = association_columns([view], followed_in_picture(view, None, 1, whole=True).match)
    assert (told["reason"][told["target"] == ""] == "surplus").all()
    assert (told["target"] == "").sum() == 2

"""The targets of one camera are put together by the motion in its picture."""

import numpy as np
import pytest

from vidtrack.location.cameras.followed import Rows, view_of
from vidtrack.location.one_camera.in_picture import findings_of_picture, followed_in_picture

T = np.arange(240) / 30


def paths(rng, noise=0.05):
    """Two that pass each other in the picture at 4 s, (2, 240, 2) px."""
    one = np.stack([100 + 60 * T, 200 + 30 * np.sin(2 * T)], -1)
    other = np.stack([580 - 60 * T, 230 + 40 * np.cos(1.7 * T)], -1)
    return np.stack([one, other]) + rng.normal(0, noise, (2, T.size, 2))


def table(b, name, number=-1, flag="", bound=False):
    n = len(b)
    words = np.full(n, name, object), b, np.full((n, 2), 0.05), np.where(np.isnan(b[:, 0]), "lost", flag).astype(object)
    return Rows(T, *words, np.full(n, "", object), np.full(n, number), np.full(n, bound), np.full((n, 3), np.nan))


def joined(*parts):
    return Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def exchanged(rng, bound=False):
    """A view in which the tracker exchanged both where they met; and the truth."""
    b = paths(rng)
    hidden = np.abs(b[0, :, 0] - b[1, :, 0]) < 12
    after = np.arange(T.size) > np.flatnonzero(hidden)[-1]
    tracks = np.where(hidden[:, None], np.nan, np.where(after[:, None], b[::-1], b))
    pieces = []
    for k, (name, track) in enumerate(zip(("a", "b"), tracks, strict=True)):
        for number, part in ((2 * k, ~after), (2 * k + 1, after)):
            keep = part & ~hidden
            own = table(track, name, number, bound=bound and not number % 2)
            pieces.append(Rows(*(np.asarray(column)[keep] for column in own)))
    rows = joined(*(table(track, name) for name, track in zip(("a", "b"), tracks, strict=True)))
    return view_of("cam1", rows, joined(*pieces), None, None), b, hidden


@pytest.mark.parametrize("limit", [2, None])
def test_tracks_that_were_exchanged_where_targets_met_are_put_right(limit):
    view, b, hidden = exchanged(np.random.default_rng(0))
    found = followed_in_picture(view, None, limit, whole=True)
    assert found.labels == ["a", "b"]
    assert (np.isnan(found.b[..., 0]) == hidden).all()
    assert np.nanmax(np.abs(found.b - b)) == 0
    assert (found.flag[:, hidden] == "lost").all()
    assert set(found.flag[:, ~hidden].ravel()) == {""}
    assert findings_of_picture(view, found, limit) == []


def test_names_of_start_boxes_hold_where_tracks_begin():
    view, b, _ = exchanged(np.random.default_rng(1), bound=True)
    found = followed_in_picture(view, ["b", "a"], 2, whole=True)
    order = [found.labels.index(name) for name in ("a", "b")]
    assert np.nanmax(np.abs(found.b[order] - b)) == 0


def test_what_is_followed_besides_the_targets_is_said_with_its_place():
    b = paths(np.random.default_rng(2))
    rows = joined(table(b[0], "a"), table(b[1], "b"))
    view = view_of("cam1", rows, None, None, None)
    found = followed_in_picture(view, None, 1, whole=True)
    (finding,) = findings_of_picture(view, found, 1)
    assert finding.code == "more-targets-located"
    assert "2 things are followed where 1 were asked for" in finding.text


def test_all_gives_each_target_rows_from_its_first_sample_to_its_last():
    b = paths(np.random.default_rng(3))
    b[1, :40] = np.nan
    b[0, 200:] = np.nan
    view = view_of("cam1", joined(table(b[0], "a"), table(b[1], "b")), None, None, None)
    found = followed_in_picture(view, None, None, whole=False)
    assert [np.flatnonzero(kept)[[0, -1]].tolist() for kept in found.kept] == [[0, 199], [40, 239]]

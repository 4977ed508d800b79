"""Which tracklets are one target: by the names given while these agree with the cameras, else by association."""

import numpy as np
import pytest

from tests.association.swarm import T, seen, swarm
from vidtrack.geometry.epipolar import epipolar_distance
from vidtrack.location.cameras.views import View, brought
from vidtrack.location.matching import match_errors, matched
from vidtrack.simulate.rig import thesis_rig

CAMERAS = thesis_rig(2)
NAMES = ["a", "b", "c"]


def scene(names=NAMES, n=3, seed=0, cameras=CAMERAS):
    """Views of n targets in their true order in every camera, under `names` (of each camera, where they are lists)."""
    rng = np.random.default_rng(seed)
    p = swarm(n, rng)
    tracks, orders = seen(cameras, p, rng)
    views = []
    for i, (camera, track, order) in enumerate(zip(cameras, tracks, orders, strict=True)):
        b = track[np.argsort(order)]
        own = names[i] if names and isinstance(names[0], list) else names
        shape = b.shape[:2]
        piece = np.where(np.isfinite(b[..., 0]), np.arange(n)[:, None], -1)
        views.append(
            View(
                f"cam{i + 1}",
                camera,
                None,
                T,
                np.full(T.size, "", object),
                list(own),
                b,
                np.full(b.shape, 0.1),
                np.full(shape, "", object),
                True,
                piece,
                np.arange(n),
                np.zeros(n, bool),
            )
        )
    return views


def match(views, names=NAMES, limit=3, tolerance=3.0):
    findings = []
    sights = [brought(v, v.t, v.t) for v in views]
    return matched(views, sights, names, limit, tolerance, findings), findings


def test_names_that_agree_are_kept_and_nothing_is_said():
    found, findings = match(scene())
    assert found.labels == NAMES
    assert [t.tolist() for t in found.trajectory] == [[0, 1, 2]] * 2
    assert (found.error_px < 0.5).all()
    assert np.isinf(found.lead).all()
    assert np.isnan(found.bias_px)
    assert (found.n_common > 0.9 * T.size).all()
    assert findings == []


def test_names_exchanged_in_one_camera_are_found_by_the_cameras_and_said():
    found, (finding,) = match(scene([["a", "b", "c"], ["a", "c", "b"]]))
    assert finding.code == "names-exchanged"
    assert "cam2's c is cam1's b" in finding.text or "cam1's b is cam2's c" in finding.text
    assert sorted(found.labels) == NAMES
    assert (found.error_px < 0.5).all()
    assert found.trajectory[0].tolist() == found.trajectory[1].tolist()


def test_without_names_association_decides_and_the_first_camera_s_names_stand():
    found, findings = match(scene([["t1", "t2", "t3"], ["t3", "t1", "t2"]]), names=None)
    assert findings == []
    assert [found.labels[k] for k in found.trajectory[0]] == ["t1", "t2", "t3"]
    assert found.trajectory[0].tolist() == found.trajectory[1].tolist()
    assert np.isfinite(found.lead).all()


def test_one_target_in_every_camera_is_that_target_however_far_the_lines_lie_apart():
    views = scene(["t1"], n=1)
    views[1] = views[1]._replace(b=views[1].b + np.array([0.0, 40.0]))
    found, (finding,) = match(views, names=None, limit=1)
    assert found.labels == ["t1"]
    assert (finding.level, finding.code) == ("bad", "match-contradicted")
    assert found.error_px[0] > 20


def test_a_name_that_no_two_cameras_see_at_one_moment_is_said():
    views = scene(["a"], n=1)
    for v, hidden in zip(views, (slice(0, T.size // 2), slice(T.size // 2, T.size)), strict=True):
        v.b[:, hidden] = np.nan
        v.piece[:, hidden] = -1
    found, findings = match(views, names=["a"], limit=1)
    assert np.isnan(found.error_px).all()
    assert found.n_common.tolist() == [0]
    assert [f.code for f in findings] in ([], ["never-seen-together"])


def test_a_tracklet_without_a_name_is_of_no_target_while_names_decide():
    views = scene([["a", "b", ""], ["a", "b", ""]])
    found, _ = match(views, names=["a", "b"], limit=2)
    assert found.labels == ["a", "b"]
    for trajectory, reason in zip(found.trajectory, found.reason, strict=True):
        assert trajectory.tolist() == [0, 1, -1]
        assert reason.tolist() == ["", "", "unnamed"]


def test_a_piece_of_a_named_track_that_lies_off_its_lines_calls_the_names_in_question():
    """The rms over a whole track may be small while the last tenth of it follows another target."""
    views = scene()
    piece = views[1].piece.copy()
    views[1].b[0, -20:] += [0.0, 8.0]
    piece[0, -20:] = 3
    views[1] = views[1]._replace(piece=piece, number=np.arange(4), bound=np.zeros(4, bool))
    found, _ = match(views)
    assert found.trajectory[1][0] != -1
    assert found.trajectory[1][3] == -1 or found.error_px.max() > 1


@pytest.mark.parametrize("apart", [0.0, 2.0])
def test_the_error_is_the_rms_distance_from_the_epipolar_curves_the_larger_of_both_ways(apart):
    views = scene(n=2, names=["a", "b"])
    b = [v.b.copy() for v in views]
    b[1][1] += [0.0, apart]
    found = match_errors(CAMERAS, b)
    for k in range(2):
        one = epipolar_distance(CAMERAS[0], CAMERAS[1], b[0][k], b[1][k])
        other = epipolar_distance(CAMERAS[1], CAMERAS[0], b[1][k], b[0][k])
        rms = np.sqrt(np.nanmean(np.maximum(one**2, other**2)))
        assert found[k] == pytest.approx(rms, rel=1e-9)


def test_a_target_that_no_two_cameras_see_has_no_error():
    b = [v.b.copy() for v in scene(n=2, names=["a", "b"])]
    b[0][1] = np.nan
    assert np.isnan(match_errors(CAMERAS, b)).tolist() == [False, True]
    assert match_errors(CAMERAS, [np.full((2, 0, 2), np.nan)] * 2).shape == (2,)

"""A camera whose pictures are mirrored, turned or another camera's is named; one that is merely off is not."""

import numpy as np
import pytest

from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.location.cameras.wrong_pictures import finding_of, mistake
from vidtrack.simulate.rig import thesis_rig

T = np.linspace(0, 8, 240)


def paths(seed, n=2):
    """n targets that swing, (n, M, 3) in."""
    rng = np.random.default_rng(seed)
    swing = [rng.uniform(3, 15, 3) * np.sin(rng.uniform(1, 4, 3) * T[:, None] + rng.uniform(0, 6, 3)) for _ in range(n)]
    return np.stack(swing) + rng.uniform(-8, 8, (n, 1, 3))


def seen_by(cameras, seed, n=2):
    rng = np.random.default_rng(seed)
    return [project(c, paths(seed, n)) + rng.normal(0, 0.05, (n, T.size, 2)) for c in cameras]


def mirrored(b, size):
    return np.stack([size[0] - 1 - b[..., 0], b[..., 1]], -1)


@pytest.mark.parametrize("cameras", [2, 3, 4])
@pytest.mark.parametrize("targets", [1, 3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_each_mistake_is_named_with_its_cameras(cameras, targets, seed):
    rig = thesis_rig(cameras)
    seen = seen_by(rig, seed, targets)
    size = np.array(rig[0].image_size)
    assert mistake(rig, seen, 3.0) is None
    found = mistake(rig, [mirrored(seen[0], size), *seen[1:]], 3.0)
    assert (found.kind, found.cameras) == ("mirrored left to right", (0,))
    found = mistake(rig, [*seen[:-1], size - 1 - seen[-1]], 3.0)
    assert (found.kind, found.cameras) == ("turned by 180 degrees", (cameras - 1,))
    found = mistake(rig, [seen[1], seen[0], *seen[2:]], 3.0)
    assert (found.kind, found.cameras) == ("exchanged", (0, 1))
    assert found.with_px < 0.2 < 4.0 < found.before_px


@pytest.mark.parametrize("cameras", [2, 3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_mistake_of_all_cameras_alike_is_named_with_all_of_them(cameras, seed):
    rig = thesis_rig(cameras)
    seen, size = seen_by(rig, seed), np.array(rig[0].image_size)
    for kind, wrong in (
        ("turned by 180 degrees", [size - 1 - b for b in seen]),
        ("mirrored left to right", [mirrored(b, size) for b in seen]),
    ):
        found = mistake(rig, wrong, 3.0)
        assert (found.kind, found.cameras) == (kind, tuple(range(cameras)))
        names = ["left", "right", "top"][:cameras]
        assert "their pictures seem to be" in finding_of(found, names, others_suffice=False).text


@pytest.mark.parametrize("seed", range(6))
def test_a_camera_that_was_knocked_is_not_taken_for_one_of_them(seed):
    rig = thesis_rig(3)
    knocked = rig[1].with_(R=rotation_from_vector(np.radians([3.0, -2.0, 4.0])) @ rig[1].R)
    assert mistake(rig, seen_by([rig[0], knocked, rig[2]], seed), 3.0) is None


def test_tracks_that_share_no_moments_say_nothing():
    rig = thesis_rig(2)
    seen = seen_by(rig, 1)
    seen[0][:, :120] = np.nan
    seen[1][:, 120:] = np.nan
    assert mistake(rig, seen, 3.0) is None


def test_the_run_is_bad_unless_other_cameras_locate_it():
    rig = thesis_rig(3)
    seen = seen_by(rig, 1)
    found = mistake(rig, [seen[1], seen[0], seen[2]], 3.0)
    names = ["left", "right", "top"]
    assert finding_of(found, names, others_suffice=False).level == "bad"
    told = finding_of(found, names, others_suffice=True)
    assert told.level == "doubtful"
    assert "left and right" in told.text

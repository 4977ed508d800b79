"""A calibration clip that is another film's copy is named with that film."""

import numpy as np
import pytest

from vidtrack.verdict.copied_clips import Shown, copied_findings

NONE = np.zeros((0, 2))


def balls(seed, n=12):
    return np.random.default_rng(seed).uniform(20, 360, (n, 2))


def shown(**changed):
    own = {("cam1", "front"): Shown(balls(1), NONE, 384.0), ("cam2", "front"): Shown(balls(2), NONE, 384.0)}
    own |= {("cam1", "rear"): Shown(balls(3), NONE, 384.0), ("cam2", "rear"): Shown(balls(4), NONE, 384.0)}
    return own | {tuple(key.split("_")): value for key, value in changed.items()}


@pytest.mark.parametrize("scale", [1.0, 0.5, 1.25])
def test_a_copy_of_another_cameras_film_is_named_whatever_its_size(scale):
    blobs = np.round(scale * balls(1) + np.random.default_rng(9).normal(0, 0.1, (12, 2)), 1)
    (finding,) = copied_findings(shown(cam2_front=Shown(NONE, blobs, 384.0 * scale)))
    assert (finding.level, finding.code) == ("doubtful", "clip-copied")
    assert finding.text.startswith(
        "calibration/front: cam2's recording shows balls where cam1's of front has them (12 of"
    )
    assert finding.cure == "Put cam2's own recording of front there."


def test_a_copy_of_another_clip_of_the_same_camera_is_named():
    (finding,) = copied_findings(shown(cam1_rear=Shown(NONE, balls(1), 384.0)))
    assert "where cam1's of front has them" in finding.text


def test_clips_that_show_some_of_their_balls_few_blobs_or_others_are_no_copies():
    assert copied_findings(shown()) == []
    assert copied_findings(shown(cam2_front=Shown(balls(1)[:2], balls(1), 384.0))) == []
    assert copied_findings(shown(cam2_front=Shown(NONE, balls(1)[:5], 384.0))) == []
    assert copied_findings(shown(cam2_front=Shown(NONE, balls(7), 384.0))) == []

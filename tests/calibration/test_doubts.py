"""What the checks find of a camera that can be had."""

import numpy as np
import pytest

from tests.calibration.test_one_camera import CAMERA, sighted, task
from vidtrack.calibration.doubts import _noise_with_rich_lens as noise_with_rich_lens


def test_few_points_cannot_tell_of_a_richer_lens():
    assert np.isnan(noise_with_rich_lens(sighted().take(np.arange(20)), task(), CAMERA))
    assert noise_with_rich_lens(sighted(), task(), CAMERA) == pytest.approx(0.1, rel=0.25)

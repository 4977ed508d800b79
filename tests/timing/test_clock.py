"""The correction of one camera's time."""

import numpy as np
import pytest

from vidtrack.timing.clock import Clock


def test_a_correction_turns_about_the_first_sample():
    t = np.array([100.0, 101.0, 110.0])
    assert Clock(0.5, 100.0).corrected(t) == pytest.approx([100.5, 101.5001, 110.501])

"""The dispersion relation, against its own equation and its limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.analysis.water_waves import wave_number

G = 9.80665


@given(f=st.floats(0.02, 5), depth=st.floats(0.05, 500))
def test_the_wave_number_fulfils_the_dispersion_relation(f, depth):
    k = wave_number(f, depth, g=G)
    assert G * k * np.tanh(k * depth) == pytest.approx((2 * np.pi * f) ** 2, rel=1e-9)


def test_deep_and_shallow_water_are_its_limits():
    assert wave_number(1.0, np.inf, g=G) == pytest.approx((2 * np.pi) ** 2 / G)
    assert wave_number(1.0, 100.0, g=G) == pytest.approx((2 * np.pi) ** 2 / G)
    assert wave_number(0.01, 0.5, g=G) == pytest.approx(2 * np.pi * 0.01 / np.sqrt(G * 0.5), rel=1e-3)

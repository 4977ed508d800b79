"""The same numbers from other programs: MHKiT 1.1.2 and qats 5.5.0, run once on the records that are made here.

The numbers were obtained by

    mhkit.wave.resource.elevation_spectrum(eta, 10, 1411, window="hann", detrend=True), and of that spectrum
    significant_wave_height, peak_period, average_zero_crossing_period, energy_period;
    mhkit.utils.heights and periods (between upward crossings) of eta less its mean;
    qats.ts.TimeSeries.stats of eta; qats.motions.transform_motion of six degrees of freedom.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vidtrack.analysis.motions import basin_axes, motions_at
from vidtrack.analysis.spectra import sea_state, single_waves, spectrum, transfer

STEP = 0.1
T = np.arange(0, 1200, STEP)
F = np.linspace(0.04, 0.6, 400)


def sea():
    """Elevation of a sea of Bretschneider's spectrum, Hs 2 m, Tp 8 s, and a heave that follows it by a known law."""
    fp = 1 / 8.0
    S = 0.3125 * 2.0**2 * fp**4 * F**-5 * np.exp(-1.25 * (fp / F) ** 4)
    a, phase = np.sqrt(2 * S * (F[1] - F[0])), np.random.default_rng(20).uniform(0, 2 * np.pi, F.size)
    angle = 2 * np.pi * np.outer(T, F)
    return (a * np.cos(angle + phase)).sum(1), (a * law(F) * np.cos(angle + phase - 0.3)).sum(1)


def law(f):
    return 0.8 / (1 + (f / 0.3) ** 4)


def test_moments_of_the_spectrum_are_those_of_mhkit():
    eta, _ = sea()
    found = sea_state(spectrum(STEP, eta))
    assert found.Hm0 == pytest.approx(2.0113843216, rel=1e-3)
    assert found.Tz == pytest.approx(5.8573712568, rel=2e-3)
    assert found.Te == pytest.approx(6.9085239195, rel=2e-3)
    assert found.Tp == pytest.approx(7.8388888889, rel=0.03)  # MHKiT takes the line, here the parabola about it counts


def test_single_waves_are_those_of_mhkit_and_qats():
    found = single_waves(STEP, sea()[0])
    assert len(found.height) == 202
    assert found.Tz == pytest.approx(5.924257425743, rel=1e-3)  # both give this number
    assert found.H13 == pytest.approx(1.8650952562687, rel=2e-3)
    assert found.Hmax == pytest.approx(2.7421648894729, rel=1e-3)


def test_the_transfer_function_is_the_law_that_made_the_response():
    eta, heave = sea()
    found = transfer(STEP, eta, heave)
    use = (found.f > 0.08) & (found.f < 0.3)
    assert np.abs(found.H[use]) == pytest.approx(law(found.f[use]), rel=0.02)
    assert np.angle(found.H[use]) == pytest.approx(-0.3, abs=0.02)


def test_a_named_point_moves_as_qats_moves_it():
    origin = np.array([[1.0, 0.5, 0.0], [2.0, -1.0, 0.2], [3.0, 2.0, -0.3]])
    roll, pitch, yaw = [3.0, -8.0, 20.0], [5.0, 12.0, -4.0], [10.0, -30.0, 170.0]
    by_qats = [
        [10.451784790313846, -0.0208953038102363, 2.095813054654511],
        [9.427429265353013, -7.093044666150319, 1.5069434587903086],
        [-5.190483880882427, 6.394470147536273, 2.4576449951757082],
    ]
    R = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll]), degrees=True).as_matrix()
    found = motions_at(origin, R, np.zeros((3, 6, 6)), (9.0, -2.0, 3.0), basin_axes("+x", "+z"))
    assert found.motion[:, :3] + found.rest == pytest.approx(np.array(by_qats), abs=1e-9)

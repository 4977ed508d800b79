"""A centroid that something moved for a moment shows in its residuals, and in the sigma of that sample alone."""

import numpy as np
import pytest
from scipy.stats import chi2

from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.sudden_misses import unlikely_chi2, with_grown_sigma
from vidtrack.simulate.rig import thesis_rig

T = np.linspace(0, 8, 400)
PATH = np.stack([12 * np.sin(T), 4 * np.cos(1.7 * T), 3 * np.sin(2.3 * T)], -1)[None]
SD = 0.02


def located(seed, n, moved=None, scale=1.0):
    """Positions by n cameras; `moved`: samples in which the first camera's centroid is off, and by how many px."""
    cameras = thesis_rig(n)
    rng = np.random.default_rng(seed)
    b = np.stack([project(c, PATH) for c in cameras]) + scale * rng.normal(0, SD, (n, 1, T.size, 2))
    if moved is not None:
        b[0, 0, moved[0], 1] += moved[1]
    sd = np.full(b.shape, SD)
    return with_grown_sigma(locate_points(cameras, b, sd=sd, reject=3.0), sd)


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_alone_grows_nothing(n, seed):
    assert located(seed, n)[1].sum() <= 1
    assert located(seed, n, scale=3.0)[1].sum() <= 1  # a run that scatters more than its sd all along is another matter


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("px", [0.4, 1.0])
def test_a_centroid_that_was_moved_gets_the_sigma_that_it_deserves(n, px):
    where = [40, 41, 42, 200]
    now, grown, _ = located(3, n, (where, px))
    assert np.isin(where, np.flatnonzero(grown[0])).all()
    assert grown.sum() <= len(where) + 1
    z = np.abs(now.point - PATH)[0] / now.sigma[0]
    assert z[where].max() < 5
    plain = located(3, n).located
    rest = ~grown[0]
    assert now.sigma[0, rest] == pytest.approx(plain.sigma[0, rest], rel=0.02)


def test_a_few_samples_say_nothing_of_what_is_usual():
    cameras = thesis_rig(2)
    b = np.stack([project(c, PATH[:, :10]) for c in cameras])
    b[0, 0, 4, 1] += 1.0
    sd = np.full(b.shape, SD)
    assert not with_grown_sigma(locate_points(cameras, b, sd=sd, reject=3.0), sd)[1].any()


@pytest.mark.parametrize("freedom", [1, 3, 5])
@pytest.mark.parametrize(("deviations", "beyond"), [(0.0, 0.5), (3.719, 1e-4)])
def test_chance_is_that_of_chi_squared(freedom, deviations, beyond):
    assert unlikely_chi2(freedom, deviations) == pytest.approx(chi2.isf(beyond, freedom), rel=0.075)

"""A hint at a zoom is held in the sigma of positions in a plane."""

from functools import partial

import numpy as np
import pytest

from vidtrack.location.one_camera.plane import scaled_plane, world_covariance, world_from_frame_buffer
from vidtrack.location.one_camera.plane_zoom import with_zoom_in_plane

CENTRE = (255.5, 239.5)
RNG = np.random.default_rng(1)
B = RNG.uniform(0, 500, (60, 2))
SD = np.full_like(B, 0.05)


def by_scale(b, sd):
    plane = scaled_plane(0.1, 1.25)
    return world_from_frame_buffer(plane, b), world_covariance(plane, b, sd)


@pytest.mark.parametrize("zoom", [0.006, -0.004])
def test_positions_through_a_zoomed_lens_are_within_sigma(zoom):
    true, known = by_scale(B, SD)
    seen = CENTRE + (B - CENTRE) * np.exp(zoom)
    plain, held = by_scale(seen, SD), with_zoom_in_plane(by_scale, zoom, CENTRE)(seen, SD)
    off = np.abs(plain[0] - true)
    sigma = np.sqrt(np.diagonal(held[1], axis1=-2, axis2=-1))
    assert (off > 5 * np.sqrt(np.diagonal(known, axis1=-2, axis2=-1))).any(-1).mean() > 0.8
    np.testing.assert_array_equal(held[0], plain[0])
    assert (off < 1.001 * sigma).all()
    assert np.median(sigma / np.maximum(off, 1e-3)) < 1.2


def test_lost_samples_stay_lost():
    b = np.vstack([B, [[np.nan, np.nan]]])
    p, covariance = with_zoom_in_plane(by_scale, 0.01, CENTRE)(b, np.full_like(b, 0.05))
    assert np.isnan(p[-1]).all()
    assert np.isnan(covariance[-1]).all()
    assert np.isfinite(covariance[:-1]).all()


def test_nothing_changes_where_nothing_hints_at_a_zoom():
    places = partial(by_scale)
    assert with_zoom_in_plane(places, 0.0, CENTRE) is places

"""Light and dark on a target move its centroid: what a highlight, a mark or a shadow on it adds to the sd."""

from fractions import Fraction

import numpy as np
import pytest

from tests.discs import picture as discs
from vidtrack.stages.track import track
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.centroiding.background import background_plane, sums_of
from vidtrack.tracking.centroiding.components import CUTTING
from vidtrack.tracking.centroiding.surface import SURFACE, Surfaces, surface_shift
from vidtrack.tracking.centroiding.template import Known, apply_template
from vidtrack.tracking.centroiding.window import segment_windows
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample

SHAPE, LEVEL, LIGHT, RADIUS = (80, 100), 40.0, 100.0, 6.0


def picture(k, glossy, rng, radius=RADIUS):
    """A ball and its middle; a bright point wanders over a glossy one."""
    x, y = 30 + 0.7 * k, 40 + 6 * np.sin(k / 6)
    balls, angle = [(x, y, radius, LIGHT)], k / 5
    if glossy:
        balls.append((x + 3 * np.cos(angle), y + 3 * np.sin(angle), 1.8, 100.0))
    return discs(SHAPE, balls, level=LEVEL, noise=1.5, rng=rng), (x, y)


def film(glossy, n=50):
    rng = np.random.default_rng(2)
    made = [picture(k, glossy, rng) for k in range(n)]
    frames = [Frame(k, Fraction(k, 25), luma, False, None) for k, (luma, _) in enumerate(made)]
    info = VideoInfo(SHAPE[1], SHAPE[0], Fraction(25), field_order="progressive")
    table = track(frames, info, targets=1).centroids
    return table[["Xf", "Yf"]].to_numpy() - [at for _, at in made], table[["sd_x", "sd_y"]].to_numpy(), table["flag"]


def test_a_highlight_that_wanders_is_in_the_sd_of_every_sample_that_it_moves():
    error, sd, flag = film(glossy=True)
    assert (flag == "").all()
    assert np.abs(error).max() > 0.2
    assert not ((np.abs(error) > 5 * sd) & (np.abs(error) > 0.1)).any()
    assert np.sqrt(np.mean((error / sd) ** 2)) > 0.4  # and no larger than it need be


def test_a_plain_ball_keeps_its_small_sd(monkeypatch):
    sd = film(glossy=False)[1]
    monkeypatch.setattr(Surfaces, "sd", lambda self, sd, radius: np.zeros_like(sd))
    np.testing.assert_array_equal(sd, film(glossy=False)[1])


@pytest.mark.parametrize("radius", [2.0, 3.0, 6.0, 9.0])
def test_the_grid_of_pixels_on_razor_sharp_edges_is_no_light_on_the_target(radius):
    rng, surfaces, size = np.random.default_rng(4), Surfaces(1), np.array([[2 * radius, 2 * radius]])
    for k in range(40):
        luma = discs((60, 60), [(25 + 0.31 * k, 30.0 + 0.17 * k, radius, 150.0)], level=LEVEL, noise=0.4, rng=rng)
        at, pixels = np.array([[[25 + 0.31 * k, 30.0 + 0.17 * k]]]), np.array([np.pi * radius**2])
        level, detection = np.array([LEVEL + 75]), Detection(noise=0.4)
        seen = segment_windows([Sample(luma, 0.0)], at, size=size, pixels=pixels, threshold=level, detection=detection)
        surfaces.seen(k, np.array([0]), seen.values[-2:, 0], seen.clear[0])
    assert not surfaces.sd(np.full((2, 40, 1), 0.002), np.array([radius])).any()
    assert surfaces.sd(np.full((2, 40, 1), 0.002)).any() == (radius < 9)  # it is not too little for nothing


def by_hand(right):
    """A square of 6 x 6 px, 100 above a background of 0, whose right column is `right` instead."""
    grey = np.zeros((26, 1, 26 + CUTTING.separator), np.float32)
    grey[10:16, 0, 10:16] = 100
    grey[10:16, 0, 15] = right
    mask = (grey > 50).astype(np.uint8)
    sums = sums_of(26, 26)
    plane = background_plane(grey, mask, sums, 1.0)
    x = grey[0:26, 0, :26].sum(axis=0) @ (np.arange(26) - 12.5) / grey.sum()
    middle = np.array([[x], [0.0]])
    return x, surface_shift(grey, mask, plane, sums, np.array([50.0]), middle, np.array([float(grey.sum())]))


def test_what_is_bright_on_one_side_is_seen_and_what_is_alike_is_not():
    x, s = by_hand(100)
    assert (x, s[0, 0]) == pytest.approx((0.0, 0.0), abs=1e-9)
    x, s = by_hand(200)
    # mass 5 x 600 + 1200; the cut square has its middle at 0 and a mass of 36 x 50
    assert x == pytest.approx(6 * 100 * 2.5 / 4200)
    assert s[0, 0] == pytest.approx(x * 1800 / 4200)
    assert s[1, 0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("lines", [1, 2])
def test_template_and_segmentation_see_the_same_surface(lines):
    rng = np.random.default_rng(1)
    luma, (x, y) = picture(4, True, rng)
    sample = Sample(luma[::lines], 0.0, 0, lines)
    where, size = np.array([[[x, y]]]), np.array([[12.0, 12.0 / lines]])
    pixels, level = np.array([113.0 / lines]), np.array([LEVEL + LIGHT / 2])
    detection = Detection(noise=1.5)
    segmented = segment_windows([sample], where, size=size, pixels=pixels, threshold=level, detection=detection)
    known = Known(size, np.array([1.5]), np.array([1.5]), pixels, level)
    template = apply_template([sample], where, known, detection)
    one, other = (seen.values[-2:, 0, 0] for seen in (segmented, template))
    assert np.hypot(*one) > 0.08
    np.testing.assert_allclose(one, other, atol=0.03)


def test_few_looks_and_chance_add_nothing_and_one_odd_look_only_beside_itself():
    rng, sd = np.random.default_rng(0), np.full((2, 80, 1), 0.02)
    looks = rng.normal(0, 0.4 * 0.02, (10, 2, 1))

    def added(looks):
        surfaces = Surfaces(1)
        for k, s in enumerate(looks):
            surfaces.seen(8 * k, np.array([0]), s, np.array([True]))
        return surfaces.sd(sd)

    assert not added(looks).any()
    assert not added(looks[: SURFACE.fewest - 1] + 5 * np.arange(SURFACE.fewest - 1)[:, None, None]).any()
    looks[5, 0] = 0.06
    out = added(looks)[0, :, 0]
    assert out[34:46].min() > 0.1
    assert not out[:32].any()
    assert not out[49:].any()


def test_a_bright_spot_that_goes_round_a_small_ball_is_in_the_sd_of_all_its_samples():
    """As it was seen of a ball of 2.6 px: in the middle in half of the looks, by their median no more than chance."""
    x = [-0.001, -0.063, -0.02, 0.062, -0.009, -0.007, -0.015, 0.064, -0.011, -0.03]
    y = [0.037, 0.033, -0.052, -0.024, 0.029, -0.061, 0.044, -0.007, -0.044, 0.026]
    surfaces = Surfaces(1)
    for k, at in zip([0, 1, 3, 6, 10, 15, 21, 28, 36, 43], zip(x, y, strict=True), strict=True):
        surfaces.seen(k, np.array([0]), np.array(at)[:, None], np.array([True]))
    assert surfaces.sd(np.full((2, 50, 1), 0.0216), np.array([2.616])).min() > 0.25 / 5


def test_what_was_not_clear_or_is_no_target_is_not_looked_at():
    surfaces = Surfaces(1)
    for k in range(10):
        surfaces.seen(k, np.array([0, 1]), np.full((2, 2), float(k)), np.array([False, True]))
        surfaces.seen(k, np.array([0]), np.full((2, 1), np.nan), np.array([True]))
    assert not surfaces.sd(np.full((2, 10, 1), 0.02)).any()


def test_looks_on_the_way_back_count_as_if_they_had_been_in_order():
    rng, sd = np.random.default_rng(5), np.full((2, 40, 2), 0.01)
    looks = [(k, rng.normal(0, 0.05, (2, 1))) for k in range(0, 40, 4)]
    forward, whole, back = Surfaces(2), Surfaces(2), Surfaces(3)
    for k, shift in looks:
        whole.seen(k, np.array([1]), shift, np.array([True]))
        some, number, place = (forward, k, 1) if k >= 20 else (back, 19 - k, 2)
        some.seen(number, np.array([place]), shift, np.array([True]))
    forward.followed_back(back, lambda sample, place: (19 - sample, place - 1, np.ones(sample.size, bool)))
    assert forward.sd(sd).any()
    assert np.array_equal(forward.sd(sd), whole.sd(sd))
    none = Surfaces(2)
    none.followed_back(back, lambda sample, place: (19 - sample, place - 1, np.zeros(sample.size, bool)))
    assert not none.sd(sd).any()

"""What is dark beside a target, or hides its rim, does not move its centroid: ropes and edges, behind it and before."""

import cv2
import numpy as np
import pytest
from scipy.special import ndtr

from tests.discs import disc, windows
from tests.tracking.centroiding.test_deblending import NOISE, measured
from vidtrack.tracking.centroiding.background import Sums, background_plane
from vidtrack.tracking.centroiding.components import Windows, components
from vidtrack.tracking.centroiding.dark_neighbours import Dark, dark_beside, one_sided, plane_of_most

LEVEL, CONTRAST = 45.0, 120.0


def beside(n, radius, dim, *, width=6.0, into=0.0, in_front=False, edge=False, seed=0):
    """Windows (side, n, side) of targets beside something `dim` grey levels off, which reaches `into` px into them."""
    rng = np.random.default_rng(seed)
    side = int(2 * radius) + 17
    y, x = np.mgrid[:side, :side].astype(float)
    truth = side // 2 + rng.uniform(-0.5, 0.5, (n, 2))
    angle = rng.uniform(0, 2 * np.pi, n)
    pictures = []
    for at, a in zip(truth, angle, strict=True):
        off = (x - at[0]) * np.cos(a) + (y - at[1]) * np.sin(a) - (radius - into)
        own = ndtr(off / 0.7) * (1 if edge else ndtr((width - off) / 0.7))
        share = cv2.GaussianBlur(disc((side, side), *at, radius), (0, 0), 0.6)
        light = np.full((side, side), LEVEL)
        for cover, level in (((share, LEVEL + CONTRAST), (own, LEVEL + dim)) if in_front else
                             ((own, LEVEL + dim), (share, LEVEL + CONTRAST))):  # fmt: skip
            light += cover * (level - light)
        pictures.append(light + rng.normal(0, NOISE, light.shape))
    return np.clip(np.rint(np.stack(pictures, axis=1)), 0, 255).astype(np.uint8), truth


@pytest.mark.parametrize(
    ("settings", "most"),
    [
        ({"radius": 6.0, "dim": -38.0}, 0.04),
        ({"radius": 6.0, "dim": -38.0, "width": 2.0}, 0.04),
        ({"radius": 5.0, "dim": -25.0, "into": 1.5, "edge": True}, 0.07),
        ({"radius": 9.0, "dim": -15.0, "into": 2.0, "in_front": True}, 0.05),
        ({"radius": 9.0, "dim": -15.0, "into": 3.0, "in_front": True, "edge": True}, 0.07),
    ],
    ids=str,
)
def test_what_is_dark_beside_a_target_does_not_move_it(settings, most):
    stack, truth = beside(40, **settings)
    found = measured(stack, truth, LEVEL + CONTRAST / 2)
    error = np.stack([found.x, found.y], axis=1) - truth
    z = error / np.stack([found.sd_x, found.sd_y], axis=1)
    assert np.isfinite(error).all()
    assert np.sqrt((error**2).mean()) < most
    assert np.abs(z).max() < 5
    assert np.sqrt((z**2).mean()) < 1.5


def looked_at(stack, threshold=LEVEL + CONTRAST / 2, noise=NOISE):
    zero = np.zeros(stack.shape[1], np.intp)
    mask = components(Windows(stack, zero, zero, 1.0), threshold).mask
    grey = np.pad(stack, ((0, 0), (0, 0), (0, 3))).astype(np.float32)
    sums = Sums(stack.shape[0], stack.shape[2])
    plane = background_plane(grey, mask, sums, noise)
    return grey, mask, sums, dark_beside(grey, mask, plane, sums, noise, np.full(mask.shape[1], CONTRAST))


def test_nothing_is_seen_beside_targets_alone_also_in_light_that_falls_off():
    for slope in ((0.0, 0.0), (0.8, -0.5)):
        stack, _ = windows(150, 5.0, side=30, noise=NOISE, contrast=CONTRAST, level=LEVEL, slope=slope, blur=0.6)
        assert looked_at(stack)[3].who.size <= 1


def test_what_a_coder_leaves_about_a_target_is_no_dark_thing():
    rng = np.random.default_rng(3)
    stack, _ = windows(150, 5.0, side=30, noise=0.3, contrast=CONTRAST, level=LEVEL)
    for i in range(150):  # a block of 4 x 4 pixels darker by some levels, all others smooth
        row, column = rng.integers(0, 7, 2) * 4
        stack[row : row + 4, i, column : column + 4] -= np.asarray(0.04 * CONTRAST * rng.random(), stack.dtype)
    assert not looked_at(stack, noise=0.3)[3].who.size


def test_a_rope_is_seen_up_to_the_target_and_not_in_it():
    stack, truth = beside(6, 6.0, -38.0, width=2.0)
    _, mask, _, dim = looked_at(stack)
    assert dim.who.tolist() == list(range(6))
    assert not (dim.cover & mask).any()
    y, x = np.mgrid[: stack.shape[0], : mask.shape[2]]
    for i in range(6):
        away = np.hypot(x - truth[i, 0], y - truth[i, 1])[dim.cover[:, i] > 0]
        assert away.min() < 8  # less than two px from its outline


def test_a_plane_follows_what_most_of_the_surroundings_show():
    stack, _ = beside(8, 6.0, -30.0, into=3.0, edge=True)
    grey, mask, sums, _ = looked_at(stack)
    free = (cv2.dilate(mask.reshape(len(mask), -1), np.ones((5, 5))).reshape(mask.shape) == 0).astype(np.uint8)
    free[..., -3:] = 0
    plane, scatter, _ = plane_of_most(grey, free, sums, NOISE)
    assert np.abs(plane.value - LEVEL).max() < 1.5
    assert scatter.max() < 1.3 * NOISE
    nothing = plane_of_most(grey, free * 0, sums, NOISE)[0]
    assert np.isfinite(nothing.slope).all()


def test_what_reaches_as_far_on_both_sides_is_the_targets_own():
    target, marked = np.zeros((2, 21, 1, 21), np.uint8)
    target[8:13, 0, 8:13] = 1
    marked[9:12, 0, 3:6] = marked[9:12, 0, 15:18] = 1
    assert not one_sided(marked, target).any()
    marked[9:12, 0, 15:18] = 0
    assert (one_sided(marked, target) == marked).all()
    assert (one_sided(marked, target * 0) == marked).all()  # of nothing there is no other side


def test_some_of_the_windows_keep_their_own():
    dark = np.zeros((4, 2, 5), np.uint8)
    dark[1, 0], dark[2, 1] = 1, 1
    some = Dark(np.array([3, 7]), dark).of(np.array([2, 7, 9]))
    assert some.who.tolist() == [1]
    assert some.cover.sum(axis=(0, 2)).tolist() == [0, 5, 0]

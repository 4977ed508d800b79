"""What is bright beside a target does not pull its centroid: targets, dim things, straight edges."""

import cv2
import numpy as np
import pytest

from tests.discs import disc
from tests.tracking.centroiding.test_template import DETECTION, known
from vidtrack.tracking.centroiding.background import Sums
from vidtrack.tracking.centroiding.centroid import measure
from vidtrack.tracking.centroiding.components import Windows, components
from vidtrack.tracking.centroiding.dark_neighbours import Dark
from vidtrack.tracking.centroiding.deblending import bright_neighbours, crowded, measure_beside
from vidtrack.tracking.centroiding.template import apply_template
from vidtrack.tracking.sample import Sample

NOISE, LEVEL = 3.0, 30.0


def beside(n, radius, gap, *, contrast=200.0, other=None, other_contrast=None, rope=False, seed=0):
    """Windows (side, n, side) of targets with a neighbour `gap` px from them, truth (n, 2), directions to it (n, 2)."""
    rng = np.random.default_rng(seed)
    other = radius if other is None else other
    side = int(2 * radius) + 19
    y, x = np.mgrid[:side, :side]
    truth = side // 2 + rng.uniform(-0.5, 0.5, (n, 2))
    angle = rng.uniform(0, 2 * np.pi, n)
    away = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    pictures = []
    for at, u in zip(truth, away, strict=True):
        middle = at + u * (radius + gap + other)
        deep = np.abs((x - middle[0]) * u[0] + (y - middle[1]) * u[1])
        near = np.clip(other + 0.5 - deep, 0, 1) if rope else disc((side, side), *middle, other)
        light = contrast * disc((side, side), *at, radius) + (other_contrast or contrast) * near
        pictures.append(LEVEL + cv2.GaussianBlur(light, (0, 0), 0.5) + rng.normal(0, NOISE, light.shape))
    return np.clip(np.rint(np.stack(pictures, axis=1)), 0, 255).astype(np.uint8), truth, away


def measured(stack, truth, threshold, kind="weighted"):
    zero = np.zeros(stack.shape[1], np.intp)
    view = Windows(stack, zero, zero, 1.0)
    found = components(view, threshold)
    off = np.hypot(found.x - truth[found.window, 0], found.y - truth[found.window, 1])
    order = np.lexsort((off, found.window))
    _, first = np.unique(found.window[order], return_index=True)
    return measure(view, found, order[first], noise=NOISE, kind=kind, threshold=threshold)


@pytest.mark.parametrize(
    ("settings", "most"),
    [
        ({"radius": 4.0, "gap": 1.6}, 0.015),
        ({"radius": 4.0, "gap": 3.0}, 0.012),
        ({"radius": 4.0, "gap": 1.5, "contrast": 60.0}, 0.04),
        ({"radius": 2.5, "gap": 1.5}, 0.02),
        ({"radius": 6.0, "gap": 0.5, "other": 2.5, "other_contrast": 60.0}, 0.015),
        ({"radius": 4.0, "gap": 5.0, "other": 3.0, "other_contrast": 60.0, "rope": True}, 0.015),
        ({"radius": 4.0, "gap": 1.0, "other": 3.0, "other_contrast": 60.0, "rope": True}, 0.04),
        ({"radius": 4.0, "gap": 2.0, "other": 3.0, "rope": True}, 0.03),
    ],
    ids=str,
)
def test_a_neighbour_does_not_pull(settings, most):
    stack, truth, away = beside(60, **settings)
    found = measured(stack, truth, LEVEL + settings.get("contrast", 200.0) / 2)
    error = np.stack([found.x, found.y], axis=1) - truth
    z = error / np.stack([found.sd_x, found.sd_y], axis=1)
    towards = (error * away).sum(axis=1)
    assert np.isfinite(error).all()
    assert np.sqrt((error**2).mean()) < most
    assert abs(towards.mean()) < 0.005 + 3 * towards.std() / np.sqrt(len(towards))
    assert 0.7 < np.sqrt((z**2).mean()) < 1.5


def test_its_looks_are_those_of_a_target_alone():
    near, alone = (measured(*beside(40, 4.0, gap, seed=1)[:2], 130.0) for gap in (1.5, 30.0))
    for name in ("mass", "soft", "background", "pixels"):
        assert getattr(near, name).mean() == pytest.approx(getattr(alone, name).mean(), rel=0.07)


@pytest.mark.parametrize("gap", [1.0, 3.0, 5.0])
def test_a_glance_sees_that_something_dim_is_in_its_ring(gap):
    """Also where it takes the unrest of the background as known."""
    stack, truth, _ = beside(30, 4.0, gap, other=3.0, other_contrast=60.0, rope=True)
    for k in range(30):
        sample = Sample(np.ascontiguousarray(stack[:, k]), 0.0)
        assert not apply_template([sample], truth[None, k : k + 1], known(1), DETECTION, careful=False).clear.any()


def test_a_glance_is_content_with_noise_alone():
    stack, truth, _ = beside(300, 4.0, 30.0)
    clear = [
        apply_template(
            [Sample(np.ascontiguousarray(stack[:, k]), 0.0)], truth[None, k : k + 1], known(1), DETECTION
        ).clear
        for k in range(300)
    ]
    assert np.mean(clear) == 1


def test_a_targets_own_blur_is_no_neighbour():
    low, target = np.zeros((2, 31, 1, 31), np.uint8)
    y, x = np.mgrid[-15:16, -15:16]
    target[:, 0] = np.hypot(x, y) < 4
    low[:, 0] = np.hypot(x, y) < 9
    assert not bright_neighbours(low, target, None).any()
    low[12:18, 0, 26:30] = 1
    low[:, 0] |= np.hypot(x, y) < 4
    low[:, 0] &= (np.hypot(x, y) < 5.5) | (x > 10)
    assert bright_neighbours(low, target, None).sum() == 24
    assert crowded(low, target, None).tolist() == [0]
    low[:, 0, 26:30] = 0
    low[3, 0, 3] = 1  # a speck
    assert not crowded(low, target, None).size


def test_where_nobody_turns_out_to_be_near_nothing_is_measured_anew():
    stack, _, _ = beside(2, 4.0, 30.0)
    zero = np.zeros(2, np.intp)
    view = Windows(stack, zero, zero, 1.0)
    mask = components(view, 130.0).mask
    grey = np.pad(stack, ((0, 0), (0, 0), (0, 3))).astype(np.float32)
    sums = Sums(stack.shape[0], stack.shape[2])
    settings = {"rise": np.full(2, 100.0), "pixels": mask.sum(axis=(0, 2)), "noise": NOISE, "always_fitted": False}
    settings["dark"] = Dark(np.zeros(0, np.intp), mask[:, :0])
    who, better = measure_beside(grey, mask, np.zeros_like(mask), np.arange(2), sums, **settings)
    assert not who.size
    assert not better.x.size

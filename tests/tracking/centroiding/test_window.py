"""Windows cut about predicted positions: what is measured in them, and what is reported as not clear."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.discs import disc, picture
from vidtrack.tracking.centroiding.window import segment_windows
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import HEIGHT, MASS, PIXELS, WIDTH, X, Y

DETECTION = Detection(noise=1.0)
SHAPE = (80, 120)


def measured(image, predicted, *, radius=4.0, lines=1, parity=0, detection=DETECTION):
    """What one sample shows near positions (n, 2), of targets that were discs of these radii when last seen."""
    predicted = np.atleast_2d(predicted)
    radius = np.broadcast_to(radius, len(predicted))
    size = np.stack([2 * radius + 1, (2 * radius + 1) / lines], axis=-1)
    return segment_windows(
        [Sample(image, 0.0, parity, lines)],
        predicted[None],
        size=size,
        pixels=np.pi * radius**2 / lines,
        threshold=np.full(len(predicted), 130.0),
        detection=detection,
    )


def test_one_square_of_pixels_is_measured_as_on_paper():
    image = np.full(SHAPE, 30, np.uint8)
    image[40:47, 50:57] = 230
    seen = measured(image, [53.0, 43.0])
    assert seen.clear.all()
    assert np.abs(seen.values[[X, Y], 0, 0] - (53, 43)).max() < 1e-3
    assert seen.values[[PIXELS, WIDTH, HEIGHT], 0, 0].tolist() == [49, 7, 7]
    assert abs(seen.values[MASS, 0, 0] - 49 * 200) < 1


@settings(max_examples=25, deadline=None)
@given(st.integers(-3, 3), st.integers(-3, 3), st.floats(-0.5, 0.5))
def test_the_centroid_does_not_depend_on_where_in_its_window_the_target_is(right, down, part):
    image = picture(SHAPE, [(60 + part, 40 - part, 4.0)])
    seen = measured(image, [60.0 + right, 40.0 + down])
    assert seen.clear.all()
    assert np.abs(seen.values[:2, 0, 0] - (60 + part, 40 - part)).max() < 0.02


def test_what_a_target_shows_does_not_depend_on_larger_ones_that_are_measured_with_it():
    radius = np.array([3.0, 16.0, 3.2])
    place = np.array([[20.3, 60.2], [65.1, 40.4], [105.0, 12.7]])
    discs = [(*p, r) for p, r in zip(place, radius, strict=True)]
    image = picture(SHAPE, discs, noise=1.0, rng=np.random.default_rng(0))
    seen = measured(image, place, radius=radius)
    assert seen.clear.all()
    assert np.abs(seen.values[:2, 0].T - place).max() < 0.02
    for i in range(3):
        alone = measured(image, place[i], radius=radius[i])
        assert np.array_equal(seen.values[:, 0, i], alone.values[:, 0, 0])


def test_positions_in_a_field_are_those_of_the_frame_buffer():
    whole = 30 + 200 * disc(SHAPE, 60.2, 41.3, 6.0)
    for parity in (0, 1):
        rows = np.rint(whole[parity::2]).astype(np.uint8)
        seen = measured(rows, [60.0, 41.0], radius=6.0, lines=2, parity=parity)
        assert seen.clear.all()
        assert np.abs(seen.values[:2, 0, 0] - (60.2, 41.3)).max() < 0.1


def test_a_target_of_another_size_or_absent_is_not_clear():
    seen = measured(picture(SHAPE, [(30, 30, 7.0)]), [[30.0, 30.0], [90.0, 40.0]])
    assert not seen.clear.any()


def test_a_target_whose_soft_edge_may_leave_its_window_is_not_clear():
    image = picture(SHAPE, [(60, 40, 4.0)])
    for off in ((7.0, 0.0), (-7.0, 0.0), (0.0, 7.0), (0.0, -7.0)):
        assert not measured(image, np.add((60.0, 40.0), off)).clear.any()


def test_two_targets_that_choose_one_patch_are_both_not_clear():
    seen = measured(picture(SHAPE, [(60, 40, 4.0)]), [[58.0, 40.0], [62.0, 40.0]])
    assert not seen.clear.any()

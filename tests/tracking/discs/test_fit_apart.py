"""Discs fitted together in a piece of a picture: each where it is, or none at all."""

import numpy as np

from tests.discs import disc
from vidtrack.tracking.discs.fit_apart import fit_apart
from vidtrack.tracking.discs.joint_fit import shapes_of

NOISE = 2.0


def piece(places, radius=5.0, seed=0, slope=0.3):
    rng = np.random.default_rng(seed)
    shares = [disc((60, 60), x, y, radius) for x, y in places]
    background = 40 + slope * np.arange(60)
    image = background + 150 * (1 - np.prod([1 - s for s in shares], axis=0)) + rng.normal(0, NOISE, (60, 60))
    return image.astype(np.float32)


def fitted(grey, x, y, radius=5.0, hidden=None):
    m = len(x)
    known = shapes_of(np.full(m, np.pi * radius**2), np.full((2, m), 10.0), np.full(m, 150.0))
    hidden = np.zeros(grey.shape, bool) if hidden is None else hidden
    return fit_apart(grey, hidden, np.array(x, float), np.array(y, float), known, NOISE)


def test_two_that_touch_are_measured_on_an_uneven_background():
    fit, under = fitted(piece([(26.3, 30.1), (34.6, 31.2)]), [27, 34], [30, 31])
    assert np.abs(fit.x - [26.3, 34.6]).max() < 0.1
    assert np.abs(fit.y - [30.1, 31.2]).max() < 0.1
    assert np.abs(under.background - (40 + 0.3 * np.array([26.3, 34.6]))).max() < 1


def test_what_is_left_says_whether_discs_explain_a_piece_that_is_not_measured():
    overlapping = piece([(30, 30), (33, 30)])
    fit, under = fitted(overlapping, [30, 33], [30, 30])
    assert fit is None
    assert under.left < 1.2 * NOISE
    overlapping[:, 31:34] = 20
    assert fitted(overlapping, [30, 33], [30, 30])[1].left > 5 * NOISE


def test_what_is_not_there_is_not_found():
    assert fitted(piece([(30, 30)]), [30, 41], [30, 30])[0] is None
    assert fitted(piece([]), [30], [30])[0] is None


def test_two_that_may_have_changed_places_are_not_named():
    grey = piece([(30, 25.5), (30, 34.5)])
    assert fitted(grey, [30, 30], [26, 34])[0] is not None
    assert fitted(grey, [26, 34], [30, 30])[0] is None


def test_what_something_else_lights_does_not_count():
    grey = piece([(30, 30)])
    grey[:, 44:] = 255
    hidden = np.zeros(grey.shape, bool)
    hidden[:, 42:] = True
    fit, _ = fitted(grey, [30], [30], hidden=hidden)
    assert np.hypot(fit.x - 30, fit.y - 30)[0] < 0.1


def test_what_something_beside_makes_restless_is_not_measured():
    """What is bright beside a disc and not known makes the piece's own noise as large as itself: any fit would hold."""
    for off in (-6, 0, 6):
        grey = piece([(30, 30)], radius=12.0, slope=0.0)
        grey[26:, 34 + off :] = 190 + np.random.default_rng(1).normal(0, NOISE, grey[26:, 34 + off :].shape)
        fit, under = fitted(grey, [30], [30], radius=12.0)
        print(off, fit, under.noise)
        assert fit is None

"""Damage that B pictures show in part before and after the picture that it is in: no change is sudden but one."""

from fractions import Fraction

import numpy as np
import pytest

from tests.tracking.pictures.test_damaged_pictures import N, garbage, scene
from vidtrack.timing.frame import Coded, Frame
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures


def numbers(n, between):
    """Order of coding of pictures of which every so many and one is coded before those shown between."""
    return [i if i == 0 else i - between if i % (between + 1) == 0 else i + 1 for i in range(n)]


def stepped(pictures, at, between):
    """Garbage from picture `at` on, of which those between it and the one before show their part."""
    hurt, out = garbage(pictures, slice(None), blocks=25), pictures.copy()
    share = np.clip((np.arange(len(pictures)) - at + between + 1) / (between + 1), 0, 1)[:, None, None]
    return out + 0.25 * share * (hurt - out)


def asked(pictures, coded):
    """Which frames a second look is asked about."""
    seen = set()

    def look(indices):
        seen.update(indices)
        return set()

    levels = np.clip(np.rint(pictures), 0, 255).astype(np.uint8)
    frames = [Frame(i, Fraction(i, 30), p, False, None, c) for i, (p, c) in enumerate(zip(levels, coded, strict=True))]
    assert list(DamagedPictures(8, look).over(frames)) == frames
    return seen


@pytest.mark.parametrize("between", [3, 5])
def test_a_change_in_steps_is_looked_at_where_it_is_sudden_in_the_order_of_coding(between):
    coded = [Coded(k, 0, i == 0, False) for i, k in enumerate(numbers(N, between))]
    at = 3 * (between + 1)
    assert at in asked(stepped(scene(speed=1.0), at, between), coded)
    assert at not in asked(scene(speed=1.0), coded)


def test_nothing_is_asked_of_what_moves_steadily():
    for between in (0, 1, 3):
        coded = [Coded(k, 0, i == 0, False) for i, k in enumerate(numbers(N, between))]
        assert asked(scene(speed=2.0), coded) <= {0, between + 1}  # the first ones have none to compare with


@pytest.mark.parametrize("key", [12, None])
def test_a_picture_that_never_comes_stops_it_for_a_while(key):
    n = 60
    order = numbers(n, 3)
    coded = [Coded(k, int(key is not None and i >= key), i in (0, key), False) for i, k in enumerate(order)]
    at = 20 if key else 48
    hurt = stepped(scene(speed=1.0, n=n), at, 3)
    keep = [i for i in range(n) if i != 4]
    assert at - 1 in asked(hurt[keep], [coded[i] for i in keep])  # one frame less is before it

"""Pictures of the overlay film: what is drawn where, in which colour."""

import numpy as np

from vidtrack.figures.overlay_film import WARNING, Painter
from vidtrack.stages.overlay_film import NO_BOX, Mark

BOX = (40.0, 30.0, 50.0, 40.0)
DARK = np.zeros((200, 300), np.uint8)


def places(picture, colour, within=12):
    return np.argwhere(np.abs(picture.astype(int) - colour).max(-1) <= within)


def painter(**names):
    return Painter(["a", "b"], names, "cam1")


def test_a_seen_target_gets_its_box_and_a_cross_at_the_centroid():
    one = painter()
    picture = one.painted(DARK, [Mark("a", "seen", (65.0, 50.0), BOX, "")], "")
    colour = one._colour("a")
    rows, columns = places(picture, colour, 60).T
    assert {30, 70} <= set(rows)
    assert {40, 90} <= set(columns)
    assert np.abs(picture[50, 65].astype(int) - colour).max() < 60


def reddish(picture):
    return int((picture[:90, :, 2].astype(int) > picture[:90, :, 0] + 40).sum())


def test_a_lost_target_is_drawn_in_the_colour_of_a_warning():
    lost = painter().painted(DARK, [Mark("a", "lost", (65.0, 50.0), BOX, "lost")], "")
    seen = painter().painted(DARK, [Mark("a", "seen", (65.0, 50.0), BOX, "")], "")
    assert WARNING[2] > WARNING[0] + 100
    assert reddish(lost) > 100 > 5 > reddish(seen)


def test_a_trail_joins_centroids_and_breaks_where_the_target_was_lost():
    one = painter()
    marks = [Mark("a", "seen", (20.0 + 40 * i, 150.0), NO_BOX, "") for i in range(5)]
    marks[3] = Mark("a", "lost", (0.0, 0.0), NO_BOX, "lost")
    for mark in marks[:3]:
        whole = one.painted(DARK, [mark], "")
    assert np.abs(whole[150, 40].astype(int) - one._colour("a")).max() < 60
    for mark in marks[3:]:
        broken = one.painted(DARK, [mark], "")
    assert broken[150, 145].max() == 0  # between the last one seen before and the first one after
    assert np.abs(broken[150, 40].astype(int) - one._colour("a")).max() < 60


def test_a_located_point_is_a_circle_in_the_colour_of_its_track():
    one = painter(a="bow")
    picture = one.painted(DARK, [Mark("bow", "located", (150.0, 100.0), NO_BOX, "")], "")
    assert len(places(picture, (255, 255, 255), 80)) > 10
    assert one._colour("bow") == one._colour("a") != one._colour("b")


def test_deep_pictures_are_brought_to_eight_bits_and_the_given_one_is_left_alone():
    deep = np.full((40, 60), 1023, np.uint16)
    picture = Painter([], {}, "", bits=10).painted(deep, [], "")
    assert picture[5, 5].tolist() == [255, 255, 255]
    assert deep.min() == 1023


def test_a_place_that_is_not_finite_or_far_outside_is_no_error():
    marks = [Mark("a", "located", (float("nan"), 0.0), NO_BOX, ""), Mark("a", "located", (1e9, -1e9), NO_BOX, "")]
    assert painter().painted(DARK, marks, "").shape == (200, 300, 3)

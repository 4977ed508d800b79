import time

import pytest

from tests.video.test_random_access import KINDS, film
from vidtrack.picking.ahead import Ahead
from vidtrack.video.random_access import Pictures


@pytest.mark.parametrize(("before", "now", "wanted"), [(None, 30, 33), (40, 30, 27), (20, 30, 33), (None, 69, 68)])
def test_the_next_pictures_in_the_direction_of_travel_are_decoded(tmp_path, before, now, wanted):
    pictures = Pictures(film(tmp_path / "b.mp4", *KINDS["b.mp4"]))
    ahead = Ahead()
    if before is not None:
        ahead.looked_at(pictures, before)
    pictures.picture(now)
    ahead.looked_at(pictures, now)
    for _ in range(200):
        if pictures.has(wanted):
            break
        time.sleep(0.05)
    assert pictures.has(wanted)
    ahead.close()
    assert not ahead._thread.is_alive()
    pictures.close()


def test_the_picture_that_is_looked_at_is_measured_before_its_neighbours_are_decoded(tmp_path):
    pictures = Pictures(film(tmp_path / "b.mp4", *KINDS["b.mp4"]))
    ahead, seen = Ahead(), []

    def fails():
        seen.append("first")
        raise ValueError("a picture that cannot be measured")

    for number, measure in ((10, fails), (20, lambda: seen.append((pictures.has(21), pictures.has(23))))):
        pictures.picture(number)
        ahead.looked_at(pictures, number, measure)
        for _ in range(200):
            if len(seen) >= number // 10:
                break
            time.sleep(0.02)
    ahead.close()
    pictures.close()
    assert seen == ["first", (False, False)]

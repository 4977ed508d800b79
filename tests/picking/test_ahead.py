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

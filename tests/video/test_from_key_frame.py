import numpy as np
import pytest

from tests.video.test_random_access import KINDS, film
from vidtrack.video.from_key_frame import Decoder
from vidtrack.video.reader import open_video


@pytest.mark.parametrize("key", [0, 25, 50])
def test_decoding_begins_at_the_key_frame_that_is_asked_for(tmp_path, key):
    path = film(tmp_path / "a.mp4", "libx264", {"bf": "0"})
    with open_video(path) as video:
        frames = [np.array(frame.luma) for frame in video.frames()]
        stamps = [round(i / video.info.rate / video.info.time.tick) for i in range(len(frames))]
    decoder = Decoder(path, None, None, stamps[key] if key else None)
    stamp, picture = next(decoder)
    assert stamp == stamps[key]
    np.testing.assert_array_equal(decoder.levels(picture), frames[key])
    assert len(list(decoder)) == len(frames) - key - 1
    decoder.close()


def test_levels_are_those_of_a_colour_where_one_is_asked_for(tmp_path):
    path = film(tmp_path / "a.mp4", *KINDS["b.mp4"], n=5)
    with open_video(path, colour="g") as video:
        wanted = np.array(next(video.frames()).luma)
    decoder = Decoder(path, None, "g", None)
    np.testing.assert_array_equal(decoder.levels(next(decoder)[1]), wanted)
    decoder.close()

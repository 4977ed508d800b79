import av
import numpy as np
import pytest

from vidtrack.video.random_access import Pictures
from vidtrack.video.reader import open_video


def film(path, codec, options, n=70):
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30, options=options)
        stream.width, stream.height, stream.pix_fmt, stream.gop_size = 160, 128, "yuv420p", 25
        for i in range(n):
            picture = np.full((128, 160, 3), 40, np.uint8)
            picture[50:60, 2 * i : 2 * i + 12] = 220
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return str(path)


KINDS = {
    "b.mp4": ("libx264", {"bf": "3"}),
    "b.mkv": ("libx264", {"bf": "2"}),
    "intra.mov": ("mjpeg", {"strict": "unofficial"}),
    "program.mpg": ("mpeg2video", {"bf": "2"}),
    "transport.ts": ("libx264", {"bf": "2"}),
    "raw.h264": ("libx264", {"bf": "2"}),
}


@pytest.mark.parametrize("name", KINDS)
def test_each_picture_is_the_one_that_the_stages_read_under_its_number(tmp_path, name):
    path = film(tmp_path / name, *KINDS[name])
    with open_video(path) as video:
        read = [(float(frame.time), np.array(frame.luma)) for frame in video.frames()]
    pictures = Pictures(path)
    assert len(pictures) == len(read)
    for number in (40, 0, 41, 42, 69, 3, 68, 24, 25, 26):
        np.testing.assert_array_equal(pictures.picture(number), read[number][1])
        assert pictures.time(number) == pytest.approx(read[number][0] - read[0][0], abs=1e-6)
    pictures.close()


def test_numbers_beyond_the_ends_give_the_ends(tmp_path):
    pictures = Pictures(film(tmp_path / "b.mp4", *KINDS["b.mp4"], n=9))
    assert pictures.picture(-3) is pictures.picture(0)
    assert pictures.picture(99) is pictures.picture(8)


def test_a_still_is_one_picture(tmp_path):
    import cv2

    cv2.imwrite(str(tmp_path / "s.png"), np.full((20, 30), 77, np.uint8))
    pictures = Pictures(str(tmp_path / "s.png"))
    assert len(pictures) == 1
    assert pictures.time(0) == 0
    assert (pictures.picture(0) == 77).all()

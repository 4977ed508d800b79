import threading

import av
import cv2
import numpy as np
import pytest

from tests.video.pictures import cine, tiff
from tests.video.test_reader import late_b_pictures
from vidtrack.errors import VidtrackError
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


@pytest.mark.parametrize(("name", "n"), [("program.mpg", 70), ("b.mp4", 0)])
def test_while_pictures_are_counted_it_is_said_how_many(tmp_path, name, n):
    counts = []
    Pictures(film(tmp_path / name, *KINDS[name]), counts.append).close()
    assert counts == list(range(1, n + 1))


def by_number(path, **how):
    """Every picture as the stages read it, and as it is found by its number in an order of jumps."""
    with open_video(str(path), **how) as video:
        read = [np.array(frame.luma) for frame in video.frames()]
    pictures = Pictures(str(path), **how)
    assert len(pictures) == len(read)
    last = len(read) - 1
    for number in (last // 2, 0, last, last // 3, last // 3 + 1, last - 1, 1):
        np.testing.assert_array_equal(pictures.picture(number), read[number])
    pictures.close()
    return pictures


def test_in_an_avi_whose_b_pictures_begin_late_a_number_is_that_of_the_stages(tmp_path):
    by_number(late_b_pictures(tmp_path / "a.avi"))


def moving(i, bits=8):
    picture = np.full((60, 80), 30, np.uint8 if bits == 8 else np.uint16)
    picture[20:32, i : i + 12] = 200
    return picture


def gif(folder):
    """Each picture holds only what has changed, as programs write them."""
    path = folder / "a.gif"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("gif", rate=25)
        stream.width, stream.height, stream.pix_fmt = 80, 60, "gray"
        for i in range(20):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(moving(i), format="gray")))
        container.mux(stream.encode())
    return path, {}


def numbered(folder):
    for i in range(20):
        cv2.imwrite(str(folder / f"p_{i}.png"), moving(i))
    return folder / "p_0.png", {"numbered": True, "rate": 50}


def pages(folder):
    (folder / "a.tif").write_bytes(tiff([moving(i) for i in range(20)]))
    return folder / "a.tif", {"rate": 50}


def high_speed(folder):
    (folder / "a.cine").write_bytes(cine([i / 100 for i in range(20)]))
    return folder / "a.cine", {}


def chapters(folder):
    for k in range(3):
        film(folder / f"{k}.mp4", "libx264", {"bf": "2"}, n=30)
    return folder / "0.mp4", {"parts": ["1.mp4", "2.mp4"]}


def coloured(folder):
    return film(folder / "a.mp4", "libx264", {"bf": "2"}), {"colour": "r"}


def second_stream(folder):
    path = folder / "a.mkv"
    with av.open(str(path), "w") as container:
        streams = [container.add_stream("libx264", rate=30, options={"bf": "2"}) for _ in range(2)]
        for k, stream in enumerate(streams):
            stream.width, stream.height, stream.pix_fmt = 160 >> k, 128 >> k, "yuv420p"
        for i in range(30):
            for k, stream in enumerate(streams):
                picture = np.full((128 >> k, 160 >> k, 3), 30 + 5 * i, np.uint8)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        for stream in streams:
            container.mux(stream.encode())
    return path, {"stream": 2}


def begun_late(folder):
    """A transport stream that begins amid pictures that cannot be decoded alone."""
    whole = film(folder / "whole.ts", "libx264", {"bf": "2"})
    data = (folder / "whole.ts").read_bytes()
    (folder / "a.ts").write_bytes(data[188 * 12 :])
    assert len(data) > 188 * 40, whole
    return folder / "a.ts", {}


@pytest.mark.parametrize(
    "kind", [gif, numbered, pages, high_speed, chapters, coloured, second_stream, begun_late], ids=lambda f: f.__name__
)
def test_recordings_of_every_kind_are_found_by_number(tmp_path, kind):
    path, how = kind(tmp_path)
    by_number(path, **how)


def test_only_files_without_stamps_of_their_own_are_read_from_the_beginning(tmp_path):
    ways = {"b.mp4": "_ByKeyFrame", "transport.ts": "_ByKeyFrame", "raw.h264": "_FromBeginning"}
    for name, way in ways.items():
        assert type(Pictures(film(tmp_path / name, *KINDS[name]))._source).__name__ == way
    path, how = numbered(tmp_path)
    assert type(Pictures(str(path), **how)._source).__name__ == "_ByPlace"


def test_a_picture_at_hand_comes_while_another_thread_decodes(tmp_path):
    pictures = Pictures(film(tmp_path / "b.mp4", *KINDS["b.mp4"]))
    kept = pictures.picture(3)
    asked = threading.Event()

    def give_up():
        asked.set()
        assert pictures.picture(3) is kept
        return False

    other = threading.Thread(target=lambda: pictures.picture(60, give_up))
    other.start()
    assert asked.wait(10)
    assert pictures.picture(3) is kept
    other.join()
    assert pictures.has(60)


def test_a_picture_that_is_no_longer_wanted_is_given_up(tmp_path):
    pictures = Pictures(film(tmp_path / "b.mp4", *KINDS["b.mp4"]))
    with pytest.raises(VidtrackError, match="picture 45"):
        pictures.picture(45, lambda: True)
    np.testing.assert_array_equal(pictures.picture(45), Pictures(pictures.path).picture(45))


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

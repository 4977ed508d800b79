import numpy as np
import pytest

from benchmarks.damage import WRONG, off, scene
from tests.files.clips import make_clip
from vidtrack.video.faults.picture_end import PictureEnds, WholePictures
from vidtrack.video.reader import open_video


def noisy(i, size=(160, 120), level=60.0):
    rng = np.random.default_rng(i)
    return np.clip(level + rng.normal(0, 2, size[::-1]), 0, 255).astype(np.uint8)


def flags(pictures):
    ends = PictureEnds(8)
    return [ends.spoilt(picture) for picture in pictures]


def test_garbage_down_to_the_end_is_seen_and_pictures_behind_it_are_not_blamed():
    pictures = [noisy(i) for i in range(20)]
    pictures[9] = pictures[9].copy()
    pictures[9][70:] = np.random.default_rng(5).integers(0, 256, (50, 160))
    assert [i for i, flag in enumerate(flags(pictures)) if flag] == [9]


def test_a_shift_of_the_level_from_the_damage_on_is_seen():
    pictures = [noisy(i) for i in range(20)]
    pictures[9] = pictures[9].copy()
    pictures[9][70:] += 30
    assert [i for i, flag in enumerate(flags(pictures)) if flag] == [9]


@pytest.mark.parametrize(
    "change",
    [
        lambda i: 60.0,
        lambda i: 60.0 + 80 * (i >= 10),  # a lamp
        lambda i: 60.0 + 40 * np.sin(i / 2),  # flicker
        lambda i: 20.0 + 8 * i,  # the sun
    ],
)
def test_light_that_changes_over_the_whole_picture_is_no_damage(change):
    assert not any(flags([noisy(i, level=change(i)) for i in range(24)]))


def test_something_that_crosses_the_lower_edge_is_no_damage():
    pictures = []
    for i in range(30):
        picture = noisy(i)
        picture[100:, 5 * i : 5 * i + 60] = 220
        pictures.append(picture)
    assert not any(flags(pictures))


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "options"),
    [
        ("a.avi", "ffv1", "gray", {"level": "1", "g": "1"}),
        ("b.avi", "huffyuv", "yuv422p", {}),
        ("c.avi", "mjpeg", "yuvj420p", {"qmin": "2", "qmax": "3"}),
    ],
)
def test_a_healthy_recording_is_not_blamed_and_a_byte_changed_in_it_is(tmp_path, name, codec, pix_fmt, options):
    path = make_clip(tmp_path / name, codec, pix_fmt, n=30, picture=scene((160, 120), deep=False), options=options)
    with open_video(str(path)) as video:
        whole = [np.array(frame.luma) for frame in video.frames()]
        assert video.account.problems == ()
    if codec == "ffv1":
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 0x5A
        path.write_bytes(data)
        with open_video(str(path)) as video:
            for frame, good in zip(video.frames(), whole, strict=True):
                assert frame.corrupt or off(frame.luma.astype(float), good.astype(float)) < WRONG


def test_in_place_of_a_damaged_picture_the_latest_whole_one_is_shown_where_a_decoder_leaves_what_was_in_memory():
    pictures = [noisy(i) for i in range(4)]
    shown = WholePictures("prores")
    given = [shown(p, corrupt=i in (0, 2)) for i, p in enumerate(pictures)]
    assert [g is p for g, p in zip(given, (None, pictures[1], pictures[1], pictures[3]), strict=True)][1:] == [True] * 3
    assert given[0].shape == pictures[0].shape
    assert not given[0].any()
    as_they_are = WholePictures("h264")
    assert all(as_they_are(p, corrupt=True) is p for p in pictures)

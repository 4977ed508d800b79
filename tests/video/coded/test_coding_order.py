from types import SimpleNamespace as Thing

import numpy as np
import pytest

from tests.files.clips import make_clip
from vidtrack.timing.frame import Coded
from vidtrack.video.coded.bitstream import Bitstream
from vidtrack.video.coded.coding_order import WAITING, CodingOrder, LongWaits
from vidtrack.video.reader import open_video

KINDS = {
    "h264.mp4": ("libx264", {"g": "6", "bf": "2", "x264-params": "b-pyramid=none:b-adapt=0:scenecut=0"}),
    "mpeg2.mkv": ("mpeg2video", {"g": "6", "bf": "2", "b_strategy": "0"}),
}


@pytest.mark.parametrize("name", KINDS)
def test_each_picture_knows_its_place_in_the_order_of_coding(tmp_path, name):
    """I b b P b b I b b P ... as they are shown: P is coded before the b before it, and nothing is built on b."""
    codec, options = KINDS[name]
    with open_video(str(make_clip(tmp_path / name, codec, "yuv420p", n=18, options=options))) as video:
        coded = [frame.coded for frame in video.frames()]
    assert sorted(one.number for one in coded) == list(range(18))
    keys = sum(one.key for one in coded)
    assert keys in (3, 4)
    shown = sorted((one.number, i) for i, one in enumerate(coded))
    assert [i for _, i in shown] != list(range(18))
    groups = [one.group for _, one in sorted((one.number, one) for one in coded)]
    assert groups == sorted(groups)
    assert set(groups) == set(range(keys))
    assert 8 <= sum(one.alone for one in coded) <= 12
    assert not any(one.key and one.alone for one in coded)
    assert coded[0] == Coded(0, 0, True, False)


def test_nothing_is_said_of_pictures_that_are_coded_by_themselves(tmp_path):
    with open_video(str(make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=2))) as video:
        assert [frame.coded for frame in video.frames()] == [None, None]


def test_packets_without_pictures_are_forgotten():
    order = CodingOrder(Bitstream("vp9", None), alone=False)
    for k in range(WAITING + 1):
        order.sent(Thing(pts=k, is_keyframe=k == 0))
    assert order.of(Thing(pts=0)) is None
    assert order.waiting() == list(range(WAITING // 2, WAITING + 1))
    assert order.of(Thing(pts=WAITING)) == Coded(WAITING, 0, False, False)
    assert order.of(Thing(pts=WAITING)) is None
    assert order.of(Thing(pts=None)) is None


def test_pictures_of_a_program_stream_that_wait_longer_than_any_before_are_noted():
    """I B B P B B P: a reference waits for three pictures; before a lost one it gets the stamp of the one behind."""
    waits = LongWaits("mpeg")
    for pts, dts in ((3, 0), (1, 1), (2, 2), (6, 3), (4, 4), (5, 5), (9, 6), (None, 7), (15, 9), (10, 10)):
        waits.sent(Thing(pts=pts, dts=dts))
    assert waits.odd == {15}
    other = LongWaits("mpegts")
    for pts in range(20):
        other.sent(Thing(pts=pts * pts, dts=0))
    assert other.odd == set()


def test_a_key_frame_that_comes_late_because_the_next_reference_is_lost_is_flagged(tmp_path):
    path = make_clip(tmp_path / "a.mpg", "mpeg2video", "yuv420p", n=40, options={"b": "3M", "bf": "2", "g": "12"})
    with open_video(str(path)) as video:
        whole = {frame.time: frame.luma.copy() for frame in video.frames()}
    data = bytearray(path.read_bytes())
    pictures = [i for i in range(len(data)) if data[i : i + 4] == b"\0\0\1\0"]
    kinds = [data[i + 5] >> 3 & 7 for i in pictures]  # 1 of a key frame, 2 of one built on one before, 3 of B
    lost = pictures[kinds.index(2, kinds.index(1, 1))]  # the next reference behind the second key frame
    data[lost : lost + 200] = bytes(range(9, 209))
    path.write_bytes(data)
    with open_video(str(path)) as video:
        wrong = [f.corrupt for f in video.frames() if f.time not in whole or not np.array_equal(f.luma, whole[f.time])]
    assert wrong
    assert all(wrong)

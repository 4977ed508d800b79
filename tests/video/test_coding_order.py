from types import SimpleNamespace as Thing

import pytest

from tests.files.clips import make_clip
from vidtrack.timing.frame import Coded
from vidtrack.video.bitstream import Bitstream
from vidtrack.video.coding_order import WAITING, CodingOrder
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

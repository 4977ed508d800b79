"""Tags are noted in every picture that passes, in fields where the video is interlaced."""

from fractions import Fraction

import numpy as np

from tests.tracking.tag_reading.test_tag_corners import shown
from vidtrack.timing.frame import Frame, VideoInfo
from vidtrack.tracking.pictures.damaged_pictures import DamagedPictures
from vidtrack.tracking.tag_reading.tag_reader import FLAGS, TagReader

INFO = VideoInfo(200, 160, Fraction(30), field_order="progressive")


def frames(pictures, corrupt=()):
    return [Frame(i, Fraction(i, 30), p, i in corrupt, None) for i, p in enumerate(pictures)]


def read(pictures, info=INFO, corrupt=(), **how):
    reader = TagReader("36h11", info, **how)
    passed = list(reader.over(frames(pictures, corrupt)))
    assert len(passed) == len(pictures)
    return reader.seen()


def words(seen):
    return [FLAGS[flag] for flag in seen.flag[:, 0]]


def test_each_picture_says_where_its_tags_are_or_why_not():
    picture, truth = shown()
    blank = np.full_like(picture, 110)
    seen = read([picture, blank, picture, picture], corrupt=(3,))
    assert seen.ids.tolist() == [7]
    assert words(seen) == ["", "lost", "", "lost"]
    np.testing.assert_allclose(seen.b[0, 0], truth, atol=0.05)
    assert np.isnan(seen.b[[1, 3]]).all()
    assert seen.side[0, 0] > 40


def test_nothing_is_seen_in_pictures_that_are_found_damaged_when_all_have_passed():
    picture, _ = shown()
    damage = DamagedPictures(8)
    reader = TagReader("36h11", INFO, damage=damage)
    list(reader.over(frames([picture] * 3)))
    damage.indices.add(1)
    assert words(reader.seen()) == ["", "lost", ""]


def test_a_number_that_is_there_twice_names_no_tag():
    one, _ = shown(side_px=45)
    info = VideoInfo(400, 160, Fraction(30), field_order="progressive")
    seen = read([np.hstack([one, one])], info)
    assert words(seen) == ["twice"]
    assert np.isnan(seen.b).all()


def test_only_numbers_that_are_asked_for_count():
    picture, _ = shown(number=7)
    assert read([picture], ids=[9]).ids.tolist() == [9]
    assert words(read([picture], ids=[9])) == ["lost"]


def test_two_fields_are_two_samples_half_a_frame_apart():
    """A tag that moves by 4 px a frame: each field has it where it was then, in the coordinates of the frame."""
    pictures, truths = zip(*(shown(centre=(k * 0.24, 0.0), noise=0.5) for k in range(8)), strict=True)
    woven = []
    for first, second in zip(pictures[::2], pictures[1::2], strict=True):
        frame = first.copy()
        frame[1::2] = second[1::2]
        woven.append(frame)
    info = VideoInfo(200, 160, Fraction(30), field_order="top")
    seen = read(woven, info, fields="top")
    assert seen.field.tolist() == ["top", "bottom"] * 4
    assert seen.offset.tolist() == [0.0, 0.5] * 4
    assert np.abs(seen.b[:, 0] - np.array(truths)).max() < 0.12
    assert 0.7 < np.sqrt(np.mean(((seen.b[:, 0] - np.array(truths)) / seen.sd[:, 0]) ** 2)) < 1.5

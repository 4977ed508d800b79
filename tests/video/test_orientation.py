import struct
import zlib
from fractions import Fraction
from itertools import product

import av
import cv2
import numpy as np
import pytest

from tests.files.clips import NTSC, video_frame
from vidtrack.timing.frame import VideoInfo
from vidtrack.video.orientation import STORED, Orientation, orientation_in_exif
from vidtrack.video.reader import open_video

EIGHT = [Orientation(*flags) for flags in product([False, True], repeat=3)]
LEVELS = (np.arange(48)[:, None] * 2 + np.arange(64)[None] // 2 + 20).astype(np.uint8)
LEVELS[4:12, 8:24] = 230  # in the upper left corner of the stored picture


def exif(value: int, order: str = "<") -> bytes:
    """A TIFF block that holds the orientation and, before it, another tag."""
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(order + "IH", 8, 2)
    entries = struct.pack(order + "HHII", 0x10F, 2, 1, 0) + struct.pack(order + "HHIHH", 0x112, 3, 1, value, 0)
    return head + entries + struct.pack(order + "I", 0)


def with_exif(name: str, block: bytes) -> bytes:
    data = cv2.imencode(name, LEVELS, [cv2.IMWRITE_JPEG_QUALITY, 100] if name == ".jpg" else [])[1].tobytes()
    if name == ".jpg":
        segment = b"Exif\0\0" + block
        return data[:2] + b"\xff\xe1" + struct.pack(">H", len(segment) + 2) + segment + data[2:]
    chunk = b"eXIf" + block
    return data[:33] + struct.pack(">I", len(block)) + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:]


def clip(path, matrix=None, *, aspect=Fraction(1), interlaced=False):
    with av.open(str(path), "w") as out:
        stream = out.add_stream("prores_ks" if interlaced else "mjpeg", rate=NTSC)
        stream.width, stream.height = 64, 48
        stream.pix_fmt = "yuv422p10le" if interlaced else "yuvj420p"
        stream.codec_context.sample_aspect_ratio = aspect
        if interlaced:
            stream.codec_context.flags |= 1 << 18
        else:
            stream.codec_context.qmin = stream.codec_context.qmax = 2
        if matrix is not None:
            stream.set_display_matrix(matrix)
        levels = LEVELS.astype(np.uint16) << 2 if interlaced else LEVELS
        for i in range(3):
            frame = video_frame(levels, stream.pix_fmt)
            frame.pts, frame.time_base = i, 1 / NTSC
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return str(path)


def seen(path) -> tuple[np.ndarray, VideoInfo, tuple[str, ...]]:
    with open_video(str(path)) as video, open_video(str(path), threads=2) as other:
        lumas = [frame.luma.copy() for frame in video.frames()]
        assert all(np.array_equal(a, b.luma) for a, b in zip(lumas, other.frames(apart=True), strict=True))
        return lumas[0], video.info, video.account.problems


def matrix_of(turn: Orientation) -> list[int]:
    """The display matrix by its definition: (x, y) is shown at (a x + c y, b x + d y)."""
    one, x, y = 65536, -1 if turn.flip_x else 1, -1 if turn.flip_y else 1
    a, b, c, d = (0, y, x, 0) if turn.transposed else (x, 0, 0, y)
    return [a * one, b * one, 0, c * one, d * one, 0, 0, 0, 1 << 30]


@pytest.mark.parametrize("name", [".jpg", ".png"])
@pytest.mark.parametrize("value", range(1, 9))
def test_a_still_lies_as_opencv_lays_it_by_its_exif(tmp_path, name, value):
    path = tmp_path / f"still{name}"
    path.write_bytes(with_exif(name, exif(value, "<" if value % 2 else ">")))
    luma, info, problems = seen(path)
    other = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert luma.shape == other.shape == (info.height, info.width)
    assert np.abs(luma.astype(int) - other).max() <= 2
    assert problems == ()


@pytest.mark.parametrize("turn", EIGHT)
def test_a_video_is_turned_as_its_display_matrix_says(tmp_path, turn):
    luma, info, problems = seen(clip(tmp_path / "a.mov", matrix_of(turn)))
    plain, *_ = seen(clip(tmp_path / "b.mov"))
    shown = np.zeros(luma.shape, np.uint8)
    for y, x in np.ndindex(*plain.shape):  # by the definition, pixel by pixel
        to_x, to_y = (y, x) if turn.transposed else (x, y)
        shown[
            shown.shape[0] - 1 - to_y if turn.flip_y else to_y, shown.shape[1] - 1 - to_x if turn.flip_x else to_x
        ] = plain[y, x]
    np.testing.assert_array_equal(luma, shown)
    assert (info.width, info.height) == luma.shape[::-1]
    assert problems == ()


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_the_rotation_recorded_is_the_one_that_was_applied(tmp_path, degrees):
    turn = next(one for one in EIGHT if one.rotation == degrees and not one.mirrored)
    luma, info, _ = seen(clip(tmp_path / "a.mov", matrix_of(turn)))
    plain, *_ = seen(clip(tmp_path / "b.mov"))
    assert (info.rotation, info.mirrored) == (degrees, False)
    np.testing.assert_array_equal(luma, np.rot90(plain, degrees // 90))


@pytest.mark.parametrize("turn", EIGHT)
def test_mirrored_means_left_and_right_exchanged_after_the_rotation(turn):
    picture = turn.applied(lambda levels: levels)(LEVELS)
    turned = np.rot90(LEVELS, turn.rotation // 90)
    np.testing.assert_array_equal(picture, turned[:, ::-1] if turn.mirrored else turned)


def test_turned_pictures_stay_read_only_and_others_are_not_copied():
    def read(picture):
        return picture

    assert STORED.applied(read) is read
    assert not EIGHT[5].applied(read)(LEVELS).flags.writeable


def test_the_aspect_of_a_pixel_turns_with_the_picture(tmp_path):
    upright = seen(clip(tmp_path / "a.mov", aspect=Fraction(8, 9)))[1]
    turned = seen(clip(tmp_path / "b.mov", matrix_of(Orientation(True, True, False)), aspect=Fraction(8, 9)))[1]
    assert upright.sample_aspect == Fraction(8, 9)
    assert turned.sample_aspect == Fraction(9, 8)


def test_a_turn_that_is_no_quarter_is_not_obeyed_and_said(tmp_path):
    half = 46341  # 45 degrees
    luma, info, problems = seen(clip(tmp_path / "a.mov", [half, half, 0, -half, half, 0, 0, 0, 1 << 30]))
    np.testing.assert_array_equal(luma, seen(clip(tmp_path / "b.mov"))[0])
    assert info.rotation == 0
    assert problems == ("the file asks players to turn the picture by -45 degrees: not obeyed",)


def test_upside_down_the_other_field_comes_first(tmp_path):
    stored = seen(clip(tmp_path / "a.mov", interlaced=True))[1].field_order
    turned = seen(clip(tmp_path / "b.mov", matrix_of(Orientation(False, True, True)), interlaced=True))[1].field_order
    assert {stored, turned} == {"top", "bottom"}
    assert Orientation(False, True, True).field_order("top", 485) == "top"  # an odd number of lines


def test_interlaced_pictures_on_their_side_are_used_whole_and_said_so(tmp_path):
    _, info, problems = seen(clip(tmp_path / "a.mov", matrix_of(Orientation(True, True, False)), interlaced=True))
    assert info.field_order == "progressive"
    assert "fields are not taken apart" in problems[0]


@pytest.mark.parametrize("head", [b"", b"II*\0", b"MM\0*\xff\xff\xff\xff", exif(9), exif(1)[:14]])
def test_a_broken_exif_block_says_nothing(head):
    assert orientation_in_exif(head) is None

"""A red ball on green of equal luma: found where it was drawn, in every way in which colour is stored."""

from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.video.pictures import SIZE, tiff
from vidtrack.errors import VidtrackError
from vidtrack.video.colour import _as_luma, combination
from vidtrack.video.luma import luma_reader
from vidtrack.video.reader import open_video

RED, GREEN = np.array([200.0, 60.0, 40.0]), np.array([40.0, 142.0, 30.0])
KR, KB = 0.299, 0.114
GREEN = GREEN + (KR * (RED - GREEN)[0] + (1 - KR - KB) * (RED - GREEN)[1] + KB * (RED - GREEN)[2])  # of equal luma
RADIUS = 7.3
FINE = 8
"""Parts of a pixel in which the ball is drawn."""


def place(i):
    return 40.3 + 2.37 * i, 44.2 + 0.41 * i


def share(i, size=SIZE, step=(1, 1), offset=(0.0, 0.0)):
    """How much of each sample the ball covers; samples are `step` px of luma apart and as large, from `offset` on."""
    width, height = size[0] // step[0], size[1] // step[1]
    fine_x = (np.arange(width * FINE) + 0.5) / FINE * step[0] - step[0] / 2 + offset[0]
    fine_y = (np.arange(height * FINE) + 0.5) / FINE * step[1] - step[1] / 2 + offset[1]
    x, y = place(i)
    inside = np.hypot(fine_x[None, :] - x, fine_y[:, None] - y) < RADIUS
    return inside.reshape(height, FINE, width, FINE).mean(axis=(1, 3))


def yuv(rgb, bits=8, full=False):
    """Y, Cb, Cr of a colour (3,) 0 to 255, by BT.601."""
    red, green, blue = np.asarray(rgb) / 255
    y = KR * red + (1 - KR - KB) * green + KB * blue
    cb, cr = (blue - y) / (2 * (1 - KB)), (red - y) / (2 * (1 - KR))
    if full:
        return np.array([255 * y, 128 + 255 * cb, 128 + 255 * cr]) * 2 ** (bits - 8)
    return np.array([16 + 219 * y, 128 + 224 * cb, 128 + 224 * cr]) * 2 ** (bits - 8)


GRIDS = {  # px of luma from one sample of chroma to the next, and where the first one lies
    "420 left": ((2, 2), (0.0, 0.5)),
    "420 centre": ((2, 2), (0.5, 0.5)),
    "422": ((2, 1), (0.0, 0.0)),
    "411": ((4, 1), (0.0, 0.0)),
    "444": ((1, 1), (0.0, 0.0)),
}


def frame_of(i, pix_fmt, grid, bits=8, full=False, size=SIZE):
    """A frame in which each sample of luma and chroma is the mean of what it covers."""
    step, offset = GRIDS[grid]
    frame = av.VideoFrame(*size, pix_fmt)
    ball, ground = yuv(RED, bits, full), yuv(GREEN, bits, full)
    dtype = np.uint8 if bits == 8 else np.uint16
    for k, plane in enumerate(frame.planes[:3]):
        part = share(i, size) if k == 0 else share(i, size, step, offset)
        values = np.rint(ground[k] + part * (ball[k] - ground[k])).astype(dtype)
        lines = np.frombuffer(plane, dtype).reshape(plane.height, -1)
        lines[:, : plane.width] = values[: plane.height, : plane.width]
    return frame


def write(path, codec, pix_fmt, grid, *, bits=8, full=False, n=4, options=None):
    with av.open(str(path), "w") as out:
        stream = out.add_stream(codec, rate=Fraction(25))
        stream.width, stream.height = SIZE
        stream.pix_fmt, stream.options = pix_fmt, options or {}
        stream.codec_context.colorspace = 5
        for i in range(n):
            frame = frame_of(i, pix_fmt, grid, bits, full)
            frame.pts, frame.time_base = i, Fraction(1, 25)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    return path


def centroid(levels):
    """Weighted above the middle between ball and ground, as the thesis has it, but soft."""
    values = levels.astype(float)
    ground, ball = np.median(values), np.sort(values, axis=None)[-40:].mean()
    weight = np.clip((values - ground) / (ball - ground), 0, 1)
    weight[weight < 0.15] = 0
    Y, X = np.mgrid[: levels.shape[0], : levels.shape[1]]
    return np.array([(X * weight).sum(), (Y * weight).sum()]) / weight.sum()


CLIPS = {
    "420.mkv": ("ffv1", "yuv420p", "420 left", 8, False, {}),
    "422.mkv": ("ffv1", "yuv422p", "422", 8, False, {}),
    "411.mkv": ("ffv1", "yuv411p", "411", 8, False, {}),
    "444.mkv": ("ffv1", "yuv444p", "444", 8, False, {}),
    "ten.mkv": ("ffv1", "yuv420p10le", "420 left", 10, False, {}),
    "jpeg.avi": ("mjpeg", "yuvj420p", "420 centre", 8, True, {"qmin": "1", "qmax": "1"}),
    "h264.mp4": ("libx264", "yuv420p", "420 left", 8, False, {"crf": "3"}),
    "prores.mov": ("prores_ks", "yuv422p10le", "422", 10, False, {}),
}
HUE = {"hue": 0.0, "width": 120.0}


@pytest.mark.parametrize("colour", [{"hue": 0.0, "width": 180.0}, HUE, (1.0, -1.0, 0.0), "r"], ids=str)
@pytest.mark.parametrize("name", CLIPS)
def test_a_red_ball_on_green_of_equal_luma_is_where_it_was_drawn(tmp_path, name, colour):
    codec, pix_fmt, grid, bits, full, options = CLIPS[name]
    path = write(tmp_path / name, codec, pix_fmt, grid, bits=bits, full=full, options=options)
    with open_video(str(path), colour=colour) as video:
        assert video.info.bits == (8 if bits == 8 else 16)
        for i, frame in enumerate(video.frames()):
            # samples of chroma that are four pixels wide say no more
            assert np.abs(centroid(frame.luma) - place(i)).max() < (0.13 if grid == "411" else 0.05)
            contrast = float(np.ptp(frame.luma)) / (2**video.info.bits - 1)
            assert contrast > 0.3
    with open_video(str(path)) as grey:
        first = next(grey.frames())
        assert np.ptp(first.luma[10:-10, 10:-10]) / 2**grey.info.bits < 0.1  # luma hardly shows it


def test_a_still_of_rgb_and_pages_of_rgb_are_read_by_colour_too(tmp_path):
    part = share(0)[..., None]
    bgr = np.rint(GREEN + part * (RED - GREEN)).astype(np.uint8)[..., ::-1]
    cv2.imwrite(str(tmp_path / "a.png"), bgr)
    cv2.imwritemulti(str(tmp_path / "a.tif"), [bgr, bgr])
    for name in ("a.png", "a.tif"):
        with open_video(str(tmp_path / name), colour=HUE) as video:
            for frame in video.frames():
                assert np.abs(centroid(frame.luma) - place(0)).max() < 0.05


def test_grey_recordings_are_refused_where_colour_is_asked_for(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((40, 60), np.uint8))
    (tmp_path / "a.tif").write_bytes(tiff([np.zeros((40, 60), np.uint8)] * 2))
    for name in ("a.png", "a.tif"):
        with (
            pytest.raises(VidtrackError, match=r"the (pictures|pages) are grey"),
            open_video(str(tmp_path / name), colour="r") as video,
        ):
            list(video.frames())


def test_fields_have_their_own_chroma():
    """In interlaced 4:2:0 chroma lies a quarter of a field's line below its first line of luma, or three quarters."""
    width, height = SIZE
    plane = np.zeros((height // 2, width // 2), np.uint8)
    for field in (0, 1):  # the ball has moved on by the second field
        x, y = place(4 * field)
        columns, rows = 2.0 * np.arange(width // 2), 4.0 * np.arange(height // 4 + 1)[: len(plane[field::2])]
        rows = rows + (0.5 if field == 0 else 2.5)
        distance = np.hypot(columns[None] - x, rows[:, None] - y)
        plane[field::2] = np.rint(200 * np.clip((RADIUS + 4 - distance) / 8, 0, 1))
    whole = _as_luma(plane, (height, width), False, True)
    for field in (0, 1):
        weight = whole[field::2]
        Y, X = np.mgrid[field:height:2, :width]
        there = np.array([(X * weight).sum(), (Y * weight).sum()]) / weight.sum()
        assert np.abs(there - place(4 * field)).max() < 0.1  # half a pixel where fields are taken for a frame


@given(st.integers(0, 255), st.floats(0, 360), st.floats(10, 180))
def test_grey_is_in_the_middle_of_every_hue(level, hue, width):
    how = combination({"hue": hue, "width": width}, KR, KB)
    assert how.constant == 0.5
    assert how.weights[0] == 0


@given(st.floats(0, 359), st.floats(20, 170))
def test_a_hue_stands_out_most_and_one_that_is_off_by_half_the_width_not_at_all(hue, width):
    how = combination({"hue": hue, "width": width}, KR, KB)
    along = np.array(how.weights[1:])
    turn = np.radians(width / 2)
    off = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ along

    def level(chroma):
        return float(along @ chroma - abs(np.dot(how.across, chroma)))

    assert level(along) == pytest.approx(1)
    assert level(off) == pytest.approx(0, abs=1e-9)
    assert level(-along) < 0


def test_a_channel_of_equal_red_green_and_blue_is_that_grey():
    for channel in "rgb":
        how = combination(channel, KR, KB)
        assert how.constant == 0
        assert how.weights[0] == pytest.approx(1)


def test_without_colour_levels_are_the_stored_luma_without_a_copy(tmp_path):
    path = write(tmp_path / "a.mkv", "ffv1", "yuv420p", "420 left", n=1)
    with open_video(str(path)) as video, av.open(str(path)) as plain:
        (frame,) = video.frames()
        picture = next(plain.decode(video=0))
        np.testing.assert_array_equal(frame.luma, luma_reader(picture.format)(picture))
        assert frame.luma.base is not None


def test_chroma_that_is_sampled_every_four_pixels_scatters_but_draws_to_no_side(monkeypatch):
    step, offset = GRIDS["411"]
    away = []
    for k in range(24):
        at = 40.0 + k / 6, 44.0 + (k % 5) / 5  # every phase of the samples, four pixels apart
        monkeypatch.setattr(f"{__name__}.place", lambda _, at=at: at)
        plane = np.rint(20 + 200 * share(0, SIZE, step, offset)).astype(np.uint8)
        levels = _as_luma(plane, SIZE[::-1], centred=False, interlaced=False)
        away.append((centroid(levels) - at)[0])
    assert abs(np.mean(away)) < 0.01
    assert 0.02 < np.std(away) < 0.05
    assert np.abs(away).max() < 0.13

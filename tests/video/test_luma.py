import av
import numpy as np
import pytest

from vidtrack.video.luma import bits_of, luma_reader

RNG = np.random.default_rng(0)
Y = RNG.integers(0, 256, (48, 66), dtype=np.uint8)
RGB = RNG.integers(0, 256, (48, 66, 3), dtype=np.uint8)


def yuv(pix_fmt: str) -> av.VideoFrame:
    """Y as luma, colour all over the place, in the format asked for."""
    frame = av.VideoFrame(66, 48, "yuv444p")
    for plane, levels in zip(frame.planes, (Y, 255 - Y, Y // 2 + 20), strict=True):
        np.frombuffer(plane, np.uint8).reshape(48, -1)[:, :66] = levels
    return frame.reformat(format=pix_fmt, threads=1)


def read(frame: av.VideoFrame) -> np.ndarray:
    return luma_reader(frame.format)(frame)


@pytest.mark.parametrize(
    "pix_fmt",
    ["yuv420p", "yuv422p", "yuv444p", "yuv411p", "yuva420p", "nv12", "nv21", "nv16", "uyvy422", "yuyv422", "yvyu422"],
)
def test_eight_bit_luma_comes_as_it_is_stored_whatever_lies_beside_it(pix_fmt):
    frame = yuv(pix_fmt)
    assert bits_of(frame.format) == 8
    np.testing.assert_array_equal(read(frame), Y)


@pytest.mark.parametrize(
    ("pix_fmt", "bits", "shift"),
    [
        ("yuv420p10le", 10, 2),
        ("yuv422p12le", 12, 4),
        ("yuv444p16le", 16, 8),
        ("p010le", 16, 8),
        ("p210le", 16, 8),
        ("y210le", 16, 8),
        ("yuv420p10be", 10, 2),
    ],
)
def test_deep_luma_comes_as_uint16_with_the_bits_it_fills(pix_fmt, bits, shift):
    frame = yuv(pix_fmt)
    assert bits_of(frame.format) == bits
    luma = read(frame)
    assert luma.dtype == np.uint16
    np.testing.assert_array_equal(luma >> shift, Y)


@pytest.mark.parametrize("pix_fmt", ["gray", "gray16le", "gray16be"])
def test_grey_is_its_own_luma(pix_fmt):
    levels = Y if pix_fmt == "gray" else Y.astype(np.uint16) * 257
    frame = av.VideoFrame.from_ndarray(levels, "gray" if pix_fmt == "gray" else "gray16le").reformat(
        format=pix_fmt, threads=1
    )
    np.testing.assert_array_equal(read(frame), levels)


def test_equal_red_green_and_blue_are_that_grey_exactly():
    grey = np.arange(256, dtype=np.uint8).reshape(4, 64)
    frame = av.VideoFrame.from_ndarray(np.stack([grey] * 3, -1), "rgb24")
    np.testing.assert_array_equal(read(frame), grey)


@pytest.mark.parametrize("pix_fmt", ["rgb24", "bgr24", "gbrp", "rgba", "bgr0", "rgb48le", "gbrp10le"])
def test_rgb_becomes_the_grey_of_bt_601_at_full_range(pix_fmt):
    frame = av.VideoFrame.from_ndarray(RGB, "rgb24").reformat(format=pix_fmt, threads=1)
    luma = read(frame)
    full = 2 ** bits_of(frame.format) - 1
    np.testing.assert_allclose(luma / full * 255, RGB @ np.array([0.299, 0.587, 0.114]), atol=0.52)


def test_a_deep_colour_picture_comes_the_same_every_time():
    frame = av.VideoFrame.from_ndarray(RGB, "rgb24").reformat(format="rgb48le", threads=1)
    first = read(frame).copy()
    assert all((read(frame) == first).all() for _ in range(200))  # with threads that raced, most differed


def test_packed_four_four_four_is_unpacked_without_a_change():
    np.testing.assert_array_equal(read(yuv("vuya")), Y)


def test_the_padding_at_the_end_of_lines_is_not_part_of_the_picture():
    frame = yuv("yuv420p")
    assert frame.planes[0].line_size > 66
    assert read(frame).shape == (48, 66)


def bitmap(levels: np.ndarray, palette: np.ndarray) -> bytes:
    """An 8-bit BMP: indices from the bottom line up, and a palette (256, 3) of red, green, blue."""
    height, width = levels.shape
    sizes = (14 + 40 + 1024 + levels.size, 0, 14 + 40 + 1024, 40, width, height)
    header = b"BM" + b"".join(size.to_bytes(4, "little") for size in sizes)
    header += (1).to_bytes(2, "little") + (8).to_bytes(2, "little")
    header += b"".join(size.to_bytes(4, "little") for size in (0, levels.size, 0, 0, 256, 0))
    colours = np.concatenate([palette[:, ::-1], np.zeros((256, 1), int)], axis=1).astype(np.uint8)
    return header + colours.tobytes() + levels[::-1].tobytes()


@pytest.mark.parametrize("levels", [Y[:, :64], Y[:40, :12]])
def test_the_palette_of_greys_of_a_frame_grabber_gives_the_levels_themselves(tmp_path, levels):
    (tmp_path / "grey.bmp").write_bytes(bitmap(levels, np.arange(256)[:, None].repeat(3, 1)))
    with av.open(str(tmp_path / "grey.bmp")) as container:
        np.testing.assert_array_equal(read(next(container.decode(video=0))), levels)


def test_any_other_palette_is_looked_up(tmp_path):
    colours = RNG.integers(0, 256, (256, 3))
    (tmp_path / "colour.bmp").write_bytes(bitmap(Y[:, :64], colours))
    with av.open(str(tmp_path / "colour.bmp")) as container:
        luma = read(next(container.decode(video=0)))
    np.testing.assert_allclose(luma, (colours @ [0.299, 0.587, 0.114])[Y[:, :64]], atol=0.51)


def test_a_view_outlives_the_frame_it_came_from():
    luma = read(yuv("yuv420p"))
    np.testing.assert_array_equal(luma, Y)

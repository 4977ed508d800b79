"""Recordings that are no video: numbered pictures, pages, raw high-speed files; the ball is where it was drawn."""

import os
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from tests.files.clips import make_clip, video_frame
from tests.video.pictures import SIZE, cine, found, levels, place, ser, tiff, write_mraw
from vidtrack.errors import VidtrackError
from vidtrack.video.reader import open_video
from vidtrack.video.times.time_source import find_time

N = 11


def read(path, **how):
    """Index, time and centroid of each picture; the info; the account."""
    with open_video(str(path), **how) as video:
        frames = [(frame.index, float(frame.time), found(frame.luma), frame.corrupt) for frame in video.frames()]
        find_time(str(path), video.info)
        return frames, video.info, video.account


def check(frames, times, numbers=None, within=0.05):
    numbers = range(len(times)) if numbers is None else numbers
    assert [index for index, *_ in frames] == list(range(len(times)))
    assert [time for _, time, *_ in frames] == pytest.approx(list(times), abs=1e-6)
    for (_, _, there, corrupt), number in zip(frames, numbers, strict=True):
        assert np.hypot(*np.subtract(there, place(number))) < within
        assert not corrupt


@pytest.mark.parametrize(
    ("ending", "bits"), [("png", 8), ("png", 16), ("tif", 8), ("tif", 16), ("bmp", 8), ("pgm", 16)]
)
def test_numbered_pictures_are_a_recording_in_the_order_of_their_numbers(tmp_path, ending, bits):
    for i in range(N):
        cv2.imwrite(str(tmp_path / f"cam1_{i + 1}.{ending}"), levels(i, bits))  # 10 comes after 9
    (tmp_path / "cam2_1.png").write_bytes(b"another camera's")
    frames, info, account = read(tmp_path / f"cam1_1.{ending}", rate=120, numbered=True)
    check(frames, np.arange(N) / 120)
    assert (info.rate, info.bits, info.width, info.height, info.is_still) == (120, bits, *SIZE, False)
    assert account.problems == ()


def test_a_picture_that_is_missing_or_spoilt_leaves_its_gap(tmp_path):
    kept = [0, 1, 2, 4, 5, 7, 8]
    for i in [*kept, 6]:
        cv2.imwrite(str(tmp_path / f"cam1_{i:04d}.png"), levels(i))
    (tmp_path / "cam1_0006.png").write_bytes(b"spoilt")
    frames, _, account = read(tmp_path / "cam1_0000.png", rate=50, numbered=True)
    check(frames, [i / 50 for i in kept], kept)
    assert account.lost == 2
    assert any("cam1_0006.png" in line for line in account.problems)


def test_without_a_rate_it_is_said_what_was_assumed(tmp_path):
    for i in range(3):
        cv2.imwrite(str(tmp_path / f"cam1_{i}.png"), levels(i))
    _, info, account = read(tmp_path / "cam1_0.png", numbered=True)
    assert info.rate == 25
    assert any("give rate" in line for line in account.problems)


def test_numbers_that_rise_by_ten_are_one_picture_after_the_other(tmp_path):
    for i in range(4):
        cv2.imwrite(str(tmp_path / f"t{10 * i}.png"), levels(i))
    frames, _, account = read(tmp_path / "t0.png", rate=10, numbered=True)
    check(frames, np.arange(4) / 10)
    assert any("rise by 10" in line for line in account.problems)


def test_a_picture_of_another_depth_among_numbered_ones_is_refused_not_mixed_in(tmp_path):
    for i in range(3):
        cv2.imwrite(str(tmp_path / f"a{i}.png"), levels(i, 16 if i == 1 else 8))
    frames, _, account = read(tmp_path / "a0.png", rate=10, numbered=True)
    check(frames, [0, 0.2], [0, 2])
    assert any("a1.png: 16 bits a pixel" in line for line in account.problems)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(("order", "big"), [("<", False), (">", False), ("<", True)])
def test_all_pages_of_a_tiff_are_read(tmp_path, bits, order, big):
    path = tmp_path / "cam1.tif"
    path.write_bytes(tiff([levels(i, bits) for i in range(30)], order=order, big=big))
    frames, info, account = read(path, rate=200)
    check(frames, np.arange(30) / 200)
    assert (info.bits, info.is_still, account.problems) == (bits, False, ())


def test_a_compressed_tiff_of_colour_pages_is_read_as_grey(tmp_path):
    path = str(tmp_path / "cam1.tiff")
    cv2.imwritemulti(path, [cv2.cvtColor(levels(i), cv2.COLOR_GRAY2BGR) for i in range(N)])
    frames, _, _ = read(path, rate=25)
    check(frames, np.arange(N) / 25)


def test_a_thumbnail_in_a_tiff_is_no_page(tmp_path):
    path = tmp_path / "cam1.tif"
    path.write_bytes(tiff([levels(0), levels(1)], thumbnail=True))
    frames, _, _ = read(path)
    check(frames, [0.0])


@pytest.mark.parametrize("bits", [8, 16])
def test_a_stack_of_imagej_with_one_directory_is_read_whole_at_its_own_rate(tmp_path, bits):
    path = tmp_path / "cam1.tif"
    path.write_bytes(
        tiff([levels(i, bits) for i in range(N)], order=">", imagej=f"ImageJ=1.53\nimages={N}\nfps=125.0\n")
    )
    frames, info, account = read(path)
    check(frames, np.arange(N) / 125)
    assert info.rate == 125
    assert account.problems == ()


def test_a_tiff_whose_pages_run_in_a_circle_or_claim_giants_is_refused_or_ends(tmp_path):
    data = bytearray(tiff([levels(0), levels(1)]))
    second = data.rindex((254).to_bytes(2, "little") + (4).to_bytes(2, "little")) - 2
    data[-4:] = second.to_bytes(4, "little")  # the last directory names itself as the next
    path = tmp_path / "cam1.tif"
    path.write_bytes(bytes(data))
    check(read(path, rate=25)[0], [0, 0.04])
    giant = bytearray(tiff([levels(0), levels(1)]))
    width = giant.index((256).to_bytes(2, "little") + bytes.fromhex("040001000000")) + 8
    giant[width : width + 4] = (300_000_000).to_bytes(4, "little")
    path.write_bytes(giant)
    with pytest.raises(VidtrackError, match="claims pictures of"):
        open_video(str(path))


TIMES = [0.0, 0.0010003, 0.0021007, 0.0030001, 0.0041009, 0.0052003, 0.0060007, 0.0071001]
"""s: the recorder stepped by about a thousandth, while the header of the CINE says a hundredth."""


@pytest.mark.parametrize("bits", [8, 16])
def test_the_pictures_of_a_cine_have_their_own_times(tmp_path, bits):
    path = tmp_path / "cam1.cine"
    path.write_bytes(cine(TIMES, bits))
    frames, info, account = read(path)
    check(frames, TIMES)
    assert float(info.rate) == pytest.approx(1000, rel=0.11)
    assert account.problems == ()
    clock = info.time.fitted(np.array(TIMES))
    np.testing.assert_allclose(clock.seconds(TIMES), TIMES, atol=1e-6)


def test_a_cine_over_a_second_of_the_clock_goes_on_rising(tmp_path):
    times = [0.998, 0.999, 1.0, 1.001, 1.002]
    path = tmp_path / "cam1.cine"
    path.write_bytes(cine(times))
    check(read(path)[0], np.subtract(times, times[0]))


@pytest.mark.parametrize(("bits", "flag"), [(8, 0), (16, 0), (16, 1)])
def test_the_trailer_of_a_ser_gives_the_times_whatever_its_flag_of_byte_order(tmp_path, bits, flag):
    path = tmp_path / "cam1.ser"
    path.write_bytes(ser(TIMES, bits, flag=flag))  # programs disagree about what the flag means
    check(read(path)[0], TIMES)
    path.write_bytes(ser(TIMES, bits, flag=flag, trailer=False))
    assert any("give rate" in line for line in read(path)[2].problems)


@pytest.mark.parametrize(
    ("stored", "effective", "side", "xml"),
    [
        (8, 8, "Lower", False),
        (16, 12, "Lower", False),
        (16, 12, "Higher", True),
        (12, 12, "Lower", True),
        (16, 16, "Lower", False),
    ],
)
def test_an_mraw_is_read_by_its_header(tmp_path, stored, effective, side, xml):
    path = write_mraw(tmp_path / "cam1.mraw", N, stored=stored, effective=effective, rate=2000, side=side, xml=xml)
    frames, info, account = read(path)
    check(frames, np.arange(N) / 2000)
    assert (info.rate, info.bits, account.problems) == (2000, effective, ())


def test_an_mraw_without_its_header_or_cut_off_says_so(tmp_path):
    path = write_mraw(tmp_path / "cam1.mraw", N, stored=8, effective=8, rate=500)
    path.write_bytes(path.read_bytes()[: SIZE[0] * SIZE[1] * 4 + 100])
    frames, _, account = read(path)
    check(frames, np.arange(4) / 500)
    assert account.problems == (f"the .cih states {N} pictures, the .mraw holds 4",)
    os.unlink(tmp_path / "cam1.cih")
    with pytest.raises(VidtrackError, match=r"its header cam1\.cih is not beside it"):
        open_video(str(path))


def chapters(folder, names, *, n=10, rate=Fraction(25), codec="libx264", codes=None, first_stamp=None):
    for k, name in enumerate(names):
        make_clip(
            folder / name,
            codec,
            "yuv420p",
            n=n,
            size=SIZE,
            rate=rate,
            picture=lambda i, k=k: levels(n * k + i),
            options={"qp": "0"} if codec == "libx264" else {"b": "8M"},
            timecode=codes[k] if codes else None,
            stamps=[first_stamp[k] + i for i in range(n)] if first_stamp else None,
        )
    return folder / names[0], names[1:]


def test_chapters_follow_each_other_without_a_gap(tmp_path):
    first, others = chapters(tmp_path, ["GX010001.MP4", "GX020001.MP4", "GX030001.MP4"])
    frames, _, account = read(first, parts=others)
    check(frames, np.arange(30) / 25, within=0.2)
    assert account.problems == ()
    assert account.frames == 30


def test_chapters_are_placed_by_stamps_that_run_on(tmp_path):
    first, others = chapters(tmp_path, ["00001.MTS", "00002.MTS"], first_stamp=[0, 12])  # two pictures lost between
    frames, _, account = read(first, parts=others)
    check(frames, [*np.arange(10) / 25, *(np.arange(10) + 12) / 25], within=0.2)
    assert any("00002.MTS begins 0.08 s after the end" in line for line in account.problems)


def test_chapters_are_placed_by_time_code_where_stamps_begin_anew(tmp_path):
    first, others = chapters(tmp_path, ["a_1.mov", "a_2.mov"], codes=["10:00:00:00", "10:00:01:00"])
    frames, _, account = read(first, parts=others)
    check(frames, [*np.arange(10) / 25, *(np.arange(10) / 25 + 1)], within=0.2)
    assert any("by time code" in line for line in account.problems)


def test_chapters_in_the_wrong_order_are_said_to_be(tmp_path):
    first, others = chapters(tmp_path, ["a_1.mov", "a_2.mov"], codes=["10:00:01:00", "10:00:00:00"])
    assert any("in the right order?" in line for line in read(first, parts=others)[2].problems)


def test_files_of_another_size_are_no_chapters(tmp_path):
    make_clip(tmp_path / "a_1.mp4", "libx264", "yuv420p", size=(64, 48))
    make_clip(tmp_path / "a_2.mp4", "libx264", "yuv420p", size=(96, 64))
    with pytest.raises(VidtrackError, match="no parts of one recording"):
        read(tmp_path / "a_1.mp4", parts=["a_2.mp4"])


def test_a_gif_is_read_with_its_own_delays(tmp_path):
    path = tmp_path / "cam1.gif"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("gif", rate=Fraction(10))
        stream.width, stream.height, stream.pix_fmt = *SIZE, "gray"
        for i in range(N):
            frame = video_frame(levels(i), "gray")
            frame.pts, frame.time_base = i, Fraction(1, 10)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    frames, info, _ = read(path)
    check(frames, np.arange(N) / 10)
    assert not info.is_still


@pytest.mark.parametrize(
    ("pix_fmt", "codec", "size", "bits"),
    [
        ("yuvj420p", "mjpeg", (121, 91), 8),  # odd sizes, full range
        ("yuv420p10le", "ffv1", (121, 91), 10),
        ("yuva420p", "ffv1", (120, 90), 8),  # alpha
        ("yuv444p", "ffv1", (121, 91), 8),
        ("gray12le", "ffv1", (121, 91), 12),
    ],
)
def test_odd_sizes_alpha_full_range_and_deep_levels_leave_the_ball_in_its_place(tmp_path, pix_fmt, codec, size, bits):
    path = make_clip(
        tmp_path / "a.mkv",
        codec,
        pix_fmt,
        size=size,
        n=5,
        rate=Fraction(25),
        picture=lambda i: levels(i, bits, size),
        options={"qmin": "1", "qmax": "1"} if codec == "mjpeg" else {},
    )
    frames, info, _ = read(path)
    check(frames, np.arange(5) / 25)
    assert (info.width, info.height, info.bits) == (*size, bits)

import subprocess
import sys
import tracemalloc
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.files.clips import NTSC, make_clip, moving_ball, video_frame
from vidtrack.errors import VidtrackError
from vidtrack.video.reader import open_video
from vidtrack.video.times.time_source import find_time

PACKAGE = Path(__file__).parents[2] / "vidtrack"
SHARED = Path(__file__).parents[2] / "../shared/real"

CLIPS = {  # name -> codec, pixel format, bits, options, loses nothing
    "h264.mp4": ("libx264", "yuv420p", 8, {"qp": "0"}, True),
    "h264.mkv": ("libx264", "yuv420p", 8, {"crf": "18", "bf": "2"}, False),
    "deep.mkv": ("ffv1", "yuv420p10le", 10, {}, True),
    "deeper.mkv": ("ffv1", "gray16le", 16, {}, True),
    "grey.avi": ("ffv1", "gray", 8, {}, True),
    "mpeg2.mpg": ("mpeg2video", "yuv420p", 8, {"b": "6M"}, False),
    "mpeg2.ts": ("mpeg2video", "yuv420p", 8, {"b": "6M"}, False),
    "mjpeg.avi": ("mjpeg", "yuvj420p", 8, {"qmin": "1", "qmax": "2"}, False),
    "prores.mov": ("prores_ks", "yuv422p10le", 10, {}, False),
    "tape.dv": ("dvvideo", "yuv411p", 8, {}, False),
    "tape.avi": ("dvvideo", "yuv411p", 8, {}, False),
    "raw.avi": ("rawvideo", "yuv420p", 8, {}, True),
}


def source(size: tuple[int, int], bits: int):
    eight = moving_ball(*size)

    def picture(i: int) -> np.ndarray:
        if bits == 8:
            return eight(i)
        return eight(i).astype(np.uint16) << (bits - 8) | (i + 1)  # the low bits must come through too

    return picture


@pytest.mark.parametrize("name", CLIPS)
def test_every_picture_comes_once_in_order_with_its_own_time(tmp_path, name):
    codec, pix_fmt, bits, options, lossless = CLIPS[name]
    size = (720, 480) if codec == "dvvideo" else (160, 120)
    picture = source(size, bits)
    path = make_clip(tmp_path / name, codec, pix_fmt, n=9, size=size, picture=picture, options=options)
    with open_video(str(path)) as video:
        assert (video.info.width, video.info.height, video.info.bits) == (*size, bits)
        assert video.info.rate == NTSC
        assert not video.info.is_still
        for i, frame in enumerate(video.frames()):
            assert frame.index == i
            assert abs(float(frame.time) - i / float(NTSC)) < 0.00051  # Matroska rounds to 1 ms
            assert frame.luma.shape == size[::-1]
            assert not frame.corrupt
            wrong = np.abs(frame.luma.astype(float) - picture(i))
            assert wrong.max() == 0 if lossless else wrong.mean() < 4 << (bits - 8)
    assert i == 8
    assert video.account == (9, 0, 0, ())


def test_levels_are_as_stored_and_not_stretched(tmp_path):
    ramp = np.tile(np.arange(160, dtype=np.uint8) + 50, (120, 1))
    path = make_clip(tmp_path / "ramp.mkv", "ffv1", "yuv420p", n=2, picture=lambda i: ramp)
    with open_video(str(path)) as video:
        for frame in video.frames():
            np.testing.assert_array_equal(frame.luma, ramp)


def test_the_luma_is_a_read_only_view_not_a_copy(tmp_path):
    path = make_clip(tmp_path / "a.avi", "mjpeg", "yuvj420p", n=2)
    with open_video(str(path)) as video:
        for frame in video.frames():
            assert frame.luma.base is not None
            assert not frame.luma.flags.writeable
            with pytest.raises(ValueError, match="read-only"):
                frame.luma[0, 0] = 1


def test_two_threads_give_what_one_gives(tmp_path):
    path = make_clip(tmp_path / "a.mp4", "libx264", "yuv420p", n=20)
    read = []
    for threads in (1, 2):
        with open_video(str(path), threads) as video:
            read.append([(frame.time, frame.luma.copy()) for frame in video.frames()])
    assert [time for time, _ in read[0]] == [time for time, _ in read[1]]
    assert all((a[1] == b[1]).all() for a, b in zip(*read, strict=True))


def test_the_order_is_that_of_time_even_where_pictures_are_coded_out_of_order(tmp_path):
    path = make_clip(tmp_path / "b.mp4", "libx264", "yuv420p", n=20, options={"bf": "3"})
    with open_video(str(path)) as video:
        times = [frame.time for frame in video.frames()]
    assert times == sorted(times)
    assert len(times) == 20


def test_a_rate_that_varies_is_told_from_the_stamps(tmp_path):
    stamps = [0, 33, 71, 100, 155, 170, 200, 240, 290, 310, 366, 400]
    path = make_clip(
        tmp_path / "vfr.mkv", "libx264", "yuv420p", n=12, stamps=stamps, stamp_base=Fraction(1, 1000), rate=Fraction(30)
    )
    with open_video(str(path)) as video:
        times = np.array([float(frame.time) for frame in video.frames()])
        base = video.info.time.fitted(times)
    np.testing.assert_allclose(times * 1000, stamps, atol=1e-6)
    assert not base.constant
    assert video.account.lost == 0  # in video of varying rate a long wait is no loss


def test_times_count_from_the_first_picture_whose_own_stamp_is_kept(tmp_path):
    path = make_clip(tmp_path / "a.mpg", "mpeg2video", "yuv420p", n=4)
    with open_video(str(path)) as video:
        assert video.info.start > 0  # program streams do not begin at zero
        assert next(iter(video.frames())).time == 0


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt"), [("a.png", "png", "gray"), ("a.tif", "tiff", "gray"), ("a.jpg", "mjpeg", "yuvj420p")]
)
def test_a_still_picture_is_a_video_of_one_frame(tmp_path, name, codec, pix_fmt):
    path = make_clip(tmp_path / name, codec, pix_fmt, n=1, muxer="image2")
    with open_video(str(path)) as video:
        assert video.info.is_still
        (frame,) = video.frames()
    assert frame.luma.shape == (120, 160)
    assert video.account.problems == ()


def test_the_shape_of_tape_pixels_is_read(tmp_path):
    path = make_clip(tmp_path / "tape.avi", "dvvideo", "yuv411p", n=2, size=(720, 480))
    with open_video(str(path)) as video:
        assert video.info.sample_aspect == Fraction(8, 9)
        assert video.info.field_order == "bottom"


@pytest.mark.parametrize(("flag", "order"), [("tff=1", "top"), ("bff=1", "bottom"), ("", "progressive")])
def test_the_flags_of_the_fields_are_read(tmp_path, flag, order):
    path = make_clip(tmp_path / "i.mp4", "libx264", "yuv420p", n=3, options={"x264-params": flag} if flag else {})
    with open_video(str(path)) as video:
        assert video.info.field_order == order


def test_frames_are_read_once_for_each_opening(tmp_path):
    path = make_clip(tmp_path / "a.avi", "mjpeg", "yuvj420p", n=2)
    with open_video(str(path)) as video:
        list(video.frames())
        with pytest.raises(ValueError, match="open it again"):
            next(iter(video.frames()))


@pytest.mark.parametrize("threads", [1, 3])
def test_leaving_early_leaves_nothing_hanging(tmp_path, threads):
    path = make_clip(tmp_path / "a.mp4", "libx264", "yuv420p", n=30)
    for _ in range(3):
        with open_video(str(path), threads) as video:
            next(iter(video.frames()))


def test_memory_does_not_grow_with_length(tmp_path):
    path = make_clip(tmp_path / "long.avi", "rawvideo", "gray", n=400, size=(320, 240), picture=lambda i: still)
    with open_video(str(path)) as video:
        frames = video.frames()
        for _ in range(40):
            next(frames)
        tracemalloc.start()
        for _ in frames:
            pass
        grown, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert grown < 200_000  # 360 pictures would be 28 MB


still = moving_ball(320, 240)(0)


@pytest.mark.slow
def test_the_first_frame_waits_for_no_heavy_library(tmp_path):
    path = make_clip(tmp_path / "small.mp4", "libx264", "yuv420p", n=3)
    script = f"""
from vidtrack.video.reader import open_video
from vidtrack.video.times.time_source import find_time
with open_video({str(path)!r}) as video:
    next(iter(video.frames()))
import sys
print(*sorted({{"pandas", "scipy", "matplotlib", "cv2", "pydantic"}} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(VidtrackError, match=r"nothing\.mov: no such file"):
        open_video(str(tmp_path / "nothing.mov"))


def test_an_empty_file_is_named(tmp_path):
    (tmp_path / "empty.mov").touch()
    with pytest.raises(VidtrackError, match=r"empty\.mov: is empty"):
        open_video(str(tmp_path / "empty.mov"))


def test_a_file_that_is_no_video_is_named(tmp_path):
    (tmp_path / "notes.avi").write_text("these are not pictures\n" * 50)
    with pytest.raises(VidtrackError, match=r"notes\.avi: not a video or image .*Copy the recording again"):
        open_video(str(tmp_path / "notes.avi"))


def test_a_folder_is_no_video(tmp_path):
    with pytest.raises(VidtrackError, match=f"{tmp_path.name}: "):
        open_video(str(tmp_path))


def test_an_mp4_that_was_never_closed_says_so(tmp_path):
    whole = make_clip(tmp_path / "whole.mp4", "libx264", "yuv420p", n=20).read_bytes()
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(whole[: whole.index(b"moov") - 10])
    with pytest.raises(VidtrackError, match=r"cut\.mp4: an MP4 or MOV without its index"):
        open_video(str(cut))


def test_a_recording_of_sound_alone_says_so(tmp_path):
    import av

    with av.open(str(tmp_path / "sound.mov"), "w") as container:
        track = container.add_stream("pcm_s16le", rate=48000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 4800), np.int16), "s16", "mono")
        frame.sample_rate, frame.pts, frame.time_base = 48000, 0, Fraction(1, 48000)
        container.mux(track.encode(frame))
        container.mux(track.encode(None))
    with pytest.raises(VidtrackError, match=r"sound\.mov: holds no pictures, only audio"):
        open_video(str(tmp_path / "sound.mov"))


def test_names_with_signs_that_mean_something_elsewhere_are_only_names(tmp_path):
    for name in ("50%d.avi", "a:b.avi", "run #1 ?.avi"):
        path = make_clip(tmp_path / "plain.avi", "mjpeg", "yuvj420p", n=2).rename(tmp_path / name)
        with open_video(str(path)) as video:
            assert len(list(video.frames())) == 2


def test_nothing_in_the_package_reads_video_with_opencv():
    # OpenCV gives black or stale pictures for every stream flagged as interlaced, and says that all is well
    for module in PACKAGE.rglob("*.py"):
        text = module.read_text()
        assert "VideoCapture(" not in text, module


@pytest.mark.skipif(not SHARED.exists(), reason="the shared recordings are not here")
def test_the_thrown_ball_is_read_whole():
    with open_video(str(SHARED / "ball-toss/runs/toss/cam1.mp4")) as video:
        times = [float(frame.time) for frame in video.frames()]
        assert (video.info.width, video.info.height) == (640, 480)
    assert len(times) == 13
    np.testing.assert_allclose(np.diff(times), 0.0665, atol=0.001)
    assert video.account.lost == 0


def test_frames_that_were_lost_do_not_lower_the_rate_that_was_meant(tmp_path):
    path = tmp_path / "lost.mov"
    rate = Fraction(30000, 1001)
    with av.open(str(path), "w") as out:
        stream = out.add_stream("mjpeg", rate=rate)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        for i in [*range(50), *range(52, 80)]:
            frame = av.VideoFrame.from_ndarray(np.full((48, 64), i, np.uint8), "gray").reformat(format="yuvj420p")
            frame.pts, frame.time_base = i, 1 / rate
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    with av.open(str(path)) as raw:
        assert raw.streams.video[0].average_rate != rate  # what a header that averages says
    with open_video(str(path)) as video:
        assert video.info.rate == rate


def test_a_webm_that_states_a_thousand_frames_a_second_has_the_rate_of_its_stamps(tmp_path):
    """Browsers write the scale of their stamps, 1 ms, for a rate."""
    stamps = [round(1000 * i / 30) for i in range(60) if i != 20]
    path = make_clip(
        tmp_path / "a.webm",
        "libvpx",
        "yuv420p",
        n=len(stamps),
        stamps=stamps,
        stamp_base=Fraction(1, 1000),
        rate=Fraction(1000),
        options={"lag-in-frames": "0", "deadline": "realtime"},
    )
    with open_video(str(path)) as video:
        list(video.frames())
        assert video.info.rate == 30
    assert video.account.lost == 1


def unjumped(path):
    with open_video(str(path)) as video:
        return [(float(frame.time), frame.corrupt) for frame in video.frames()], video.account, video.info


def test_b_pictures_packed_into_other_packets_come_in_order_with_their_times(tmp_path):
    path = packed_b_pictures(tmp_path / "a.avi", n=24)
    frames, account, _ = unjumped(path)
    assert [time for time, _ in frames] == pytest.approx([i / 25 for i in range(24)])
    assert not any(corrupt for _, corrupt in frames)
    assert account.lost == 0
    assert account.problems == ()
    with open_video(str(path)) as video:
        for frame in video.frames():
            x = 30 + 2.0 * float(frame.time * 25)
            assert abs(middle_of_ball(frame.luma)[0] - x) < 0.3


def late_b_pictures(path, *, n=40, since=12):
    """An AVI, whose packets have the stamps of decoding alone, of H.264 without B pictures up to picture `since`."""
    with av.open(str(path), "w") as container:
        options = {"x264-params": "bframes=3:b-adapt=0:scenecut=0:keyint=250", "crf": "18"}
        stream = container.add_stream("libx264", rate=Fraction(30), options=options)
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
        for i in range(n):
            frame = video_frame(moving_ball(160, 120)(i), "yuv420p")
            frame.pts, frame.time_base = i, Fraction(1, 30)
            frame.pict_type = av.video.frame.PictureType.NONE if not 0 < i < since else av.video.frame.PictureType.P
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def test_b_pictures_that_begin_late_in_an_avi_have_their_times_and_none_is_missing(tmp_path):
    path = late_b_pictures(tmp_path / "a.avi")
    with open_video(str(path)) as video:
        for i, frame in enumerate(video.frames()):
            assert frame.time == Fraction(i, 30)
            assert not frame.corrupt
            assert abs(middle_of_ball(frame.luma)[0] - (30 + 2.0 * i)) < 0.3
        assert video.account == (40, 0, 0, ())


def packed_b_pictures(path, *, n):
    """An AVI as DivX 5 wrote it: each B picture in the packet of one that it is built on, then an empty packet."""
    rate, size = Fraction(25), (160, 120)
    coder = av.CodecContext.create("mpeg4", "w")
    coder.width, coder.height = size
    coder.pix_fmt, coder.framerate, coder.time_base = "yuv420p", rate, 1 / rate
    coder.options, coder.gop_size = {"b": "2M", "bf": "1"}, 12
    coded = []
    for i in range(n):
        frame = video_frame(moving_ball(*size)(i), "yuv420p")
        frame.pts, frame.time_base = i, 1 / rate
        coded += [bytes(packet) for packet in coder.encode(frame)]
    coded += [bytes(packet) for packet in coder.encode(None)]
    start = min(at for at in (coded[0].find(b"\0\0\1\xb3"), coded[0].find(b"\0\0\1\xb6")) if at >= 0)
    coded[0] = coded[0][:start] + b"\0\0\1\xb2DivX503b1393p" + coded[0][start:]  # p: packed
    kinds = [data[data.index(b"\0\0\1\xb6") + 4] >> 6 for data in coded]  # 0 I, 1 P, 2 B
    skipped = "01" + "0" + "1" + "00001" + "1" + "0" + "01111"  # a P picture that is not coded, at 25 ticks a second
    empty = b"\0\0\1\xb6" + int(skipped, 2).to_bytes(2)
    packets = []
    while coded:
        data, kind = coded.pop(0), kinds.pop(0)
        if kinds and kinds[0] == 2:
            kinds.pop(0)
            packets += [(data + coded.pop(0), kind == 0), (empty, False)]
        else:
            packets.append((data, kind == 0))
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=rate)
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        for at, (data, key) in enumerate(packets):
            packet = av.Packet(data)
            packet.stream, packet.pts, packet.dts, packet.time_base, packet.is_keyframe = stream, at, at, 1 / rate, key
            container.mux(packet)
    return path


def middle_of_ball(luma):
    weight = np.clip(luma.astype(float) - 110, 0, None)
    Y, X = np.mgrid[: luma.shape[0], : luma.shape[1]]
    return (X * weight).sum() / weight.sum(), (Y * weight).sum() / weight.sum()


@pytest.mark.parametrize(
    ("name", "codec", "rate"),
    [
        ("a.h264", "libx264", Fraction(90)),
        ("a.h264", "libx264", Fraction(30)),
        ("a.hevc", "libx265", Fraction(60)),
        ("a.m2v", "mpeg2video", Fraction(60000, 1001)),
    ],
)
def test_a_raw_stream_has_the_rate_that_it_states(tmp_path, name, codec, rate):
    options = {"x265-params": "log-level=none"} if codec == "libx265" else {}
    path = make_clip(tmp_path / name, codec, "yuv420p", rate=rate, n=20, options=options)
    frames, account, info = unjumped(path)
    assert info.rate == rate
    assert account.problems == ()
    assert [time for time, _ in frames] == pytest.approx([i / float(rate) for i in range(20)], abs=1e-6)


def test_a_raw_stream_that_states_no_rate_says_what_was_assumed(tmp_path):
    path = make_clip(tmp_path / "a.mjpeg", "mjpeg", "yuvj420p", rate=Fraction(50))
    assert unjumped(path)[1].problems == ("a stream of pictures that states no rate: 25 a second assumed; give rate",)
    with open_video(str(path), rate=50) as video:
        assert [float(frame.time) for frame in video.frames()] == pytest.approx([i / 50 for i in range(12)])
        assert video.account.problems == ()


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.avi"])
def test_slow_motion_stored_at_30_runs_at_the_rate_that_is_given(tmp_path, name):
    codec = "mpeg4" if name.endswith("avi") else "libx264"
    path = make_clip(tmp_path / name, codec, "yuv420p", rate=Fraction(30), n=40, timecode="10:00:00:00")
    with open_video(str(path), rate=240) as video:
        found = find_time(str(path), video.info)
        base = replace(video.info, time=found.base).time if name.endswith("mp4") else video.info.time
        times = np.array([float(frame.time) for frame in video.frames()])
        assert video.info.rate == 240
        assert video.account.lost == 0
        assert not video.account.problems
    seconds = base.fitted(times).seconds(times)
    np.testing.assert_allclose(seconds - seconds[0], np.arange(40) / 240, atol=1e-9)
    if name.endswith("mp4"):
        assert seconds[0] == 36000


def test_a_given_rate_keeps_the_gaps_of_the_stamps(tmp_path):
    kept = [0, 1, 2, 5, 6, 7]
    path = make_clip(
        tmp_path / "a.mp4", "libx264", "yuv420p", n=6, stamps=kept, stamp_base=Fraction(1, 30), rate=Fraction(30)
    )
    with open_video(str(path), rate=120) as video:
        assert [float(frame.time) for frame in video.frames()] == pytest.approx([k / 120 for k in kept], abs=1e-5)
        assert video.account.lost == 2


def test_a_given_rate_that_is_rounded_stands_for_the_exact_one_below_300_only(tmp_path):
    path = make_clip(tmp_path / "a.mp4", "libx264", "yuv420p")
    for given, exact in (
        (29.97, Fraction(30000, 1001)),
        (239.76, Fraction(240000, 1001)),
        (1000.1, Fraction(10001, 10)),
    ):
        with open_video(str(path), rate=given) as video:
            assert video.info.rate == exact

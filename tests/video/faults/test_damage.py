import threading
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.files.clips import make_clip, moving_ball
from vidtrack.timing.frame import ReadAccount
from vidtrack.video.reader import open_video

KINDS = {
    "h264.mp4": ("libx264", "yuv420p", {"g": "30", "qp": "18"}),
    "h264.mkv": ("libx264", "yuv420p", {"g": "30", "qp": "18"}),
    "mpeg2.mpg": ("mpeg2video", "yuv420p", {"b": "3M"}),
    "mpeg2.mxf": ("mpeg2video", "yuv422p", {"b": "3M"}),
    "ffv1.mkv": ("ffv1", "gray", {"level": "3", "g": "1", "slicecrc": "1"}),
    "ffv1.avi": ("ffv1", "gray", {"g": "1"}),
    "mjpeg.avi": ("mjpeg", "yuvj420p", {}),
    "mjpeg.mov": ("mjpeg", "yuvj420p", {}),
    "prores.mov": ("prores_ks", "yuv422p10le", {}),
}
N = 240


def read(path: Path) -> tuple[dict[Fraction, np.ndarray], list[Fraction], ReadAccount]:
    """Levels by time, the times of the frames flagged, and the account."""
    with open_video(str(path)) as video:
        frames = [(frame.time, frame.luma.copy(), frame.corrupt) for frame in video.frames()]
        return {time: luma for time, luma, _ in frames}, [time for time, _, corrupt in frames if corrupt], video.account


def with_hole(whole: Path, which: int, *, seed: int = 3, zeros: bool = False) -> Path:
    """A copy in which up to 120 bytes within one packet, number `which`, are noise or zeros."""
    with av.open(str(whole)) as container:
        packets = [(packet.pos, packet.size) for packet in container.demux(container.streams.video[0]) if packet.size]
    place, size = packets[which]
    data = bytearray(whole.read_bytes())
    begin, length = place + size // 3, min(120, size // 3)
    noise = np.random.default_rng(seed).integers(0, 256, length, dtype=np.uint8)
    data[begin : begin + length] = bytes(length) if zeros else noise.tobytes()
    hurt = whole.with_stem("hurt")
    hurt.write_bytes(data)
    return hurt


@pytest.fixture(scope="module")
def clips(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    picture = moving_ball(160, 120, speed=0.4)
    pictures = [picture(i) for i in range(N)]

    def ready(name: str) -> Path:
        codec, pix_fmt, options = KINDS[name]
        deep = 2 if pix_fmt.endswith("10le") else 0
        if not (folder / name).exists():
            levels = [p.astype(np.uint16) << deep for p in pictures] if deep else pictures
            make_clip(folder / name, codec, pix_fmt, n=N, options=options, picture=levels.__getitem__)
        return folder / name

    return ready


@pytest.mark.parametrize("name", KINDS)
def test_a_hole_in_the_middle_costs_a_picture_or_two_and_the_rest_is_given(clips, name):
    hurt, flagged, account = read(with_hole(clips(name), 118))
    assert account.frames == len(hurt) >= 237
    assert account.problems
    assert account.lost == N - len(hurt)
    assert account.corrupt == len(flagged)


@pytest.mark.parametrize("which", [0, 1, 60, 119, 120, 239])
def test_where_every_slice_has_a_check_sum_no_damaged_picture_passes_for_good(clips, which):
    whole, *_ = read(clips("ffv1.mkv"))
    hurt, flagged, account = read(with_hole(clips("ffv1.mkv"), which))
    unlike = {time for time, luma in hurt.items() if not np.array_equal(luma, whole[time])}
    assert unlike == set(flagged)
    assert account.lost + account.corrupt == 1


@pytest.mark.parametrize("name", ["h264.mp4", "mpeg2.mxf"])
def test_pictures_built_on_a_damaged_one_are_flagged_up_to_the_next_key_frame(clips, name):
    whole, *_ = read(clips(name))
    hurt, flagged, account = read(with_hole(clips(name), 121))
    unlike = {time for time, luma in hurt.items() if not np.array_equal(luma, whole[time])}
    assert len(unlike) > 3
    assert unlike <= set(flagged)
    assert account.corrupt <= 32  # key frames come every 30, or 12, pictures


@pytest.mark.parametrize("name", ["h264.mkv", "mpeg2.mxf", "ffv1.avi", "mjpeg.avi"])
def test_a_recording_that_is_cut_off_gives_what_is_there_and_says_how_much_is_not(clips, name):
    data = clips(name).read_bytes()
    cut = clips(name).with_stem("cut")
    cut.write_bytes(data[: int(0.7 * len(data))])
    frames, _, account = read(cut)
    assert len(frames) > 0.6 * N
    assert account.lost == pytest.approx(N - len(frames), abs=2)
    assert any("is cut off" in line for line in account.problems)


@pytest.mark.parametrize("how", [{}, {"ahead": True}, {"apart": True}])
def test_a_recording_that_is_left_early_is_not_cut_off(clips, how):
    with open_video(str(clips("mjpeg.mov")), threads=2) as video:
        for _ in zip(range(100), video.frames(**how), strict=False):
            pass
        threading.Event().wait(0.5 if how else 0.0)  # the decoder, ahead, comes to the end
        assert video.account == (100, 0, 0, ())


def test_a_whole_recording_has_nothing_to_tell(clips):
    for name in KINDS:
        assert read(clips(name))[2] == (N, 0, 0, ()), name


def test_a_gap_in_the_time_stamps_is_a_loss_and_is_placed(tmp_path):
    stamps = [i for i in range(30) if i not in (10, 11, 20)]
    path = make_clip(
        tmp_path / "gap.mkv", "mjpeg", "yuvj420p", n=27, stamps=stamps, stamp_base=Fraction(1, 25), rate=Fraction(25)
    )
    account = read(path)[2]
    assert (account.frames, account.lost) == (27, 3)
    assert account.problems == ("3 pictures are missing (before frame 10, 18)",)


def test_a_raw_dv_tape_keeps_its_time_behind_a_spoilt_frame(tmp_path):
    path = make_clip(tmp_path / "a.dv", "dvvideo", "yuv411p", n=8, size=(720, 480))
    data = bytearray(path.read_bytes())
    data[3 * 120_000 : 3 * 120_000 + 400] = bytes([0xBF]) * 400  # it now claims to be of another line standard
    path.write_bytes(data)
    frames, _, account = read(path)
    assert [round(float(time) * 29.97) for time in frames] == [0, 1, 2, 4, 5, 6, 7]
    assert account.lost == 1


@pytest.mark.parametrize("audio", [False, True])
@pytest.mark.parametrize(("codec", "pix_fmt", "size"), [("mjpeg", "yuvj420p", (160, 120)), ("ffv1", "gray", (64, 48))])
def test_behind_frames_of_an_avi_whose_headers_are_spoilt_every_frame_keeps_its_time(
    tmp_path, codec, pix_fmt, size, audio
):
    """AVI counts its packets: without its index the frames behind would all come too early, and nobody would know."""
    sound = np.zeros(48_000) if audio else None
    path = make_clip(tmp_path / "a.avi", codec, pix_fmt, n=30, size=size, sound=sound)
    whole = read(path)[0]
    with av.open(str(path)) as container:
        places = [packet.pos for packet in container.demux(video=0) if packet.size]
    data = bytearray(path.read_bytes())
    data[places[10] - 7 : places[12] - 9] = bytes(places[12] - places[10] - 2)  # what it begins with is there
    path.write_bytes(data)
    frames, _, account = read(path)
    assert len(frames) == 28
    assert all(np.array_equal(luma, whole[time]) for time, luma in frames.items())
    assert account.lost == 2
    assert account.problems == ("2 pictures are missing (before frame 10)",)


@pytest.mark.parametrize("which", [1, 6, 7])
def test_no_picture_behind_lost_ones_of_an_avi_with_b_pictures_is_shown_at_the_time_of_another(tmp_path, which):
    """Bytes are missing at a header: its index was made up, times began too late, and P came with the P behind it."""
    options = {"g": "9", "bf": "2", "b_strategy": "0", "b": "2M"}
    path = make_clip(tmp_path / "a.avi", "mpeg4", "yuv420p", n=30, options=options, picture=moving_ball(160, 120))
    whole, *_ = read(path)
    with av.open(str(path)) as container:
        places = [packet.pos for packet in container.demux(video=0) if packet.size]
    data = path.read_bytes()
    path.write_bytes(data[: places[which] - 20] + data[places[which] + 30 :])
    hurt, flagged, account = read(path)
    wrong = {time for time, luma in hurt.items() if time not in whole or not np.array_equal(luma, whole[time])}
    assert wrong <= set(flagged)
    assert len(flagged) < 20
    assert 1 <= account.lost <= 3


def test_a_black_recording_is_called_out(tmp_path):
    black = np.full((120, 160), 16, np.uint8)
    path = make_clip(tmp_path / "black.mp4", "libx264", "yuv420p", n=70, picture=lambda i: black)
    assert "blank" in read(path)[2].problems[0]


def test_one_small_dim_ball_is_enough_not_to_be_black(tmp_path):
    def picture(i):
        levels = np.full((120, 160), 16, np.uint8)
        levels[60:63, 20 + i : 23 + i] = 60
        return levels

    path = make_clip(tmp_path / "dim.mkv", "ffv1", "gray", n=70, picture=picture)
    assert read(path)[2].problems == ()


def lens_cap(size, sd=2.0):
    def picture(i):
        return np.clip(np.rint(np.random.default_rng(i).normal(20, sd, size[::-1])), 0, 255).astype(np.uint8)

    return picture


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "size"),
    [
        ("a.mkv", "ffv1", "gray", (160, 120)),
        ("a.mpg", "mpeg2video", "yuv420p", (160, 120)),
        ("a.dv", "dvvideo", "yuv411p", (720, 480)),
    ],
)
def test_a_lens_cap_with_all_its_noise_is_called_out_in_a_short_recording_too(tmp_path, name, codec, pix_fmt, size):
    path = make_clip(tmp_path / name, codec, pix_fmt, n=9, size=size, picture=lens_cap(size))
    assert "in all 2 of 9 pictures" in read(path)[2].problems[0]


@pytest.mark.parametrize("bits", [8, 12])
def test_a_dim_ball_that_stands_out_of_the_noise_is_enough_not_to_be_black(tmp_path, bits):
    dark = lens_cap((160, 120))

    def picture(i):
        levels = dark(i)
        levels[60:64, 20 + i : 24 + i] += 30
        return levels if bits == 8 else levels.astype(np.uint16) << (bits - 8)

    path = make_clip(tmp_path / "dim.mkv", "ffv1", "gray" if bits == 8 else "gray12le", n=40, picture=picture)
    assert read(path)[2].problems == ()


@pytest.mark.parametrize("n", [10, 100])
def test_a_stuck_picture_is_called_out(tmp_path, n):
    same = moving_ball(160, 120)(0)
    path = make_clip(tmp_path / "stuck.mkv", "ffv1", "gray", n=n, picture=lambda i: same)
    assert "over and over" in read(path)[2].problems[0]


@pytest.mark.parametrize(("name", "codec", "pix_fmt"), [("a.mpg", "mpeg2video", "yuv420p"), ("a.mkv", "ffv1", "gray")])
@pytest.mark.parametrize(("n", "begins"), [(80, 31), (400, 200)])
def test_a_recording_that_gets_stuck_is_called_out_with_the_place(tmp_path, name, codec, pix_fmt, n, begins):
    picture = moving_ball(160, 120, speed=0.3)
    path = make_clip(tmp_path / name, codec, pix_fmt, n=n, picture=lambda i: picture(min(i, begins)))
    problem = read(path)[2].problems[-1]
    assert "nothing changes from picture to picture from about frame" in problem
    assert begins <= int(problem.split("about frame ")[1].split()[0]) <= begins + 31


def test_things_at_rest_in_front_of_a_camera_that_runs_are_not_stuck(tmp_path):
    path = make_clip(tmp_path / "rest.mkv", "ffv1", "gray", n=70, picture=moving_ball(160, 120, speed=0.0, noise=1.0))
    assert read(path)[2].problems == ()


@pytest.mark.parametrize(("each", "least", "most"), [(2, 30, 70), (4, 60, 90)])
def test_a_converted_frame_rate_is_called_out(tmp_path, each, least, most):
    picture = moving_ball(64, 48)
    pulled = [picture(i) for i in range(620 // each)]
    path = make_clip(tmp_path / "pulled.mkv", "ffv1", "gray", n=600, size=(64, 48), picture=lambda i: pulled[i // each])
    (problem,) = read(path)[2].problems
    share = int(problem.split("about ")[1].split(" %")[0])
    assert least < share < most


def test_a_picture_of_another_size_is_left_out_and_said(tmp_path):
    parts = [
        make_clip(tmp_path / f"{k}.ts", "mpeg2video", "yuv420p", n=10, size=size, options={"g": "1"}).read_bytes()
        for k, size in enumerate([(160, 120), (192, 144)])
    ]
    (tmp_path / "two.ts").write_bytes(b"".join(parts))
    with open_video(str(tmp_path / "two.ts")) as video:
        shapes = {frame.luma.shape for frame in video.frames()}
        account = video.account
    assert shapes == {(120, 160)}
    assert any("of another size left out" in line for line in account.problems)


def unlike(name, tmp_path, options, which, n=60):
    """Times of the pictures that differ, and of those that are flagged, where a packet has a hole of zeros."""
    path = make_clip(
        tmp_path / name, "libx264", "yuv420p", n=n, options=options, picture=moving_ball(160, 120, 1.5, 5.0)
    )
    whole, *_ = read(path)
    hurt, flagged, _ = read(with_hole(path, which, zeros=True))
    return {time for time, luma in hurt.items() if not np.array_equal(luma, whole[time])}, set(flagged)


PYRAMID = {"g": "30", "bf": "7", "sc_threshold": "0", "x264-params": "b-pyramid=normal:b-adapt=0"}


@pytest.mark.parametrize("which", range(1, 17))
def test_what_is_built_on_a_damaged_b_picture_is_flagged(tmp_path, which):
    """With a pyramid, B pictures are references: called harmless, they let 20 pictures up to 4.7 px off pass."""
    wrong, flagged = unlike("a.mp4", tmp_path, PYRAMID, which)
    assert wrong <= flagged


@pytest.mark.parametrize("which", range(19, 26))
def test_pictures_shown_before_a_key_frame_are_not_cleared_by_it(tmp_path, which):
    """Open groups: what is coded behind a key frame and shown before it is built on the group before, too."""
    options = {"g": "24", "bf": "3", "sc_threshold": "0", "x264-params": "open-gop=1:b-adapt=0"}
    wrong, flagged = unlike("a.mkv", tmp_path, options, which, n=60)
    assert wrong <= flagged


def test_damage_that_nothing_is_built_on_costs_one_picture(tmp_path):
    options = {"g": "30", "bf": "3", "sc_threshold": "0", "x264-params": "b-pyramid=none:b-adapt=0"}
    wrong, flagged = unlike("a.mp4", tmp_path, options, 7)
    assert len(flagged) == 1
    assert wrong <= flagged


@pytest.mark.parametrize("way", ["zeros", "cut"])
def test_a_raw_dv_tape_with_a_hole_shows_no_wrong_picture_without_a_flag(tmp_path, way):
    picture = moving_ball(720, 480, speed=8.0)
    path = make_clip(tmp_path / "a.dv", "dvvideo", "yuv411p", n=12, size=(720, 480), picture=picture)
    whole, *_ = read(path)
    data, at = path.read_bytes(), 4 * 120_000 + 50_000
    path.write_bytes(data[:at] + (bytes(3000) if way == "zeros" else b"") + data[at + 3000 :])
    hurt, flagged, account = read(path)
    wrong = {time for time, luma in hurt.items() if time not in whole or not np.array_equal(luma, whole[time])}
    assert wrong
    assert wrong <= set(flagged)
    assert account.problems


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "options"),
    [
        ("a.mov", "mjpeg", "yuvj420p", {}),
        ("a.mp4", "libx264", "yuv420p", {"g": "5", "bf": "0"}),
        ("a.mkv", "ffv1", "gray", {"level": "3", "g": "1", "slicecrc": "1"}),
    ],
)
def test_a_first_picture_that_cannot_be_decoded_moves_no_time(tmp_path, name, codec, pix_fmt, options):
    """Times counted from the first picture that came out were one to thirty pictures late."""
    path = make_clip(tmp_path / name, codec, pix_fmt, n=20, options=options, timecode="10:00:00:00")
    whole, *_ = read(path)
    with av.open(str(path)) as container:
        coded = bytes(next(packet for packet in container.demux(video=0) if packet.size))
    path.write_bytes(path.read_bytes().replace(coded, bytes(len(coded))))
    with open_video(str(path)) as video:
        frames = {frame.time: frame.luma.copy() for frame in video.frames() if not frame.corrupt}
        first_label = video.info.time.labels(float(min(frames)))
    assert 0 < len(frames) < 20
    assert all(np.array_equal(luma, whole[time]) for time, luma in frames.items())
    assert first_label == f"10:00:00:{20 - len(frames):02d}"


def test_the_picture_before_a_place_where_the_file_is_broken_is_flagged(tmp_path):
    """Matroska gives the packet before a cut the bytes behind it, and VP9 decodes them."""
    path = make_clip(
        tmp_path / "a.webm",
        "libvpx-vp9",
        "yuv420p",
        n=30,
        options={"crf": "20", "b": "0", "g": "10", "cpu-used": "8"},
        picture=moving_ball(160, 120, 1.5, 5.0),
    )
    whole, *_ = read(path)
    with av.open(str(path)) as container:
        coded = [bytes(p) for p in container.demux(video=0) if p.size and p.is_keyframe][1]
    data = path.read_bytes()
    at = data.index(coded) + len(coded) // 2
    path.write_bytes(data[:at] + data[at + 100 :])
    hurt, flagged, _ = read(path)
    wrong = {time for time, luma in hurt.items() if not np.array_equal(luma, whole[time])}
    assert wrong
    assert wrong <= set(flagged)


def test_pictures_built_on_one_that_is_lost_are_flagged(clips):
    """MXF leaves out what it cannot read, and MPEG-2 builds on the picture before that."""
    path = clips("mpeg2.mxf")
    whole, *_ = read(path)
    with av.open(str(path)) as container:
        places = [(p.pos, p.is_keyframe) for p in container.demux(video=0) if p.size]
    data = bytearray(path.read_bytes())
    k = next(i for i, (_, key) in enumerate(places) if key and i) + 3
    data[places[k][0] - 32 : places[k][0] + 8] = bytes(40)
    hurt_path = path.with_stem("lost")
    hurt_path.write_bytes(data)
    hurt, flagged, account = read(hurt_path)
    wrong = {time for time, luma in hurt.items() if not np.array_equal(luma, whole[time])}
    assert account.lost == 1
    assert wrong
    assert wrong <= set(flagged)

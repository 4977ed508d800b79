import os
import signal
import time
from fractions import Fraction
from itertools import islice

import av
import numpy as np
import pytest

from tests.files.clips import make_clip, moving_ball
from vidtrack.errors import VidtrackError
from vidtrack.video.processes import read_apart, shares
from vidtrack.video.processes.read_apart import CAN_FORK, ReadApart
from vidtrack.video.processes.shares import STRETCH, Share, Tables
from vidtrack.video.reader import open_video

pytestmark = pytest.mark.skipif(not CAN_FORK, reason="there is no fork here")

N = 30


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    folder = tmp_path_factory.mktemp("films")

    def ready(name="film.mov"):
        if not (folder / name).exists():
            make_clip(folder / name, "mjpeg", "yuvj420p", n=N, picture=moving_ball(96, 64, speed=0.4))
        return folder / name

    return ready


@pytest.fixture
def readers(monkeypatch):
    """All processes that were begun."""
    begun = []

    class Noted(ReadApart):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            begun.append(self)

    monkeypatch.setattr(shares, "ReadApart", Noted)
    return begun


def read(path, threads, *, apart=True, most=None, **how):
    """All that is given, and the account."""
    with open_video(str(path), threads=threads, **how) as video:
        frames = islice(video.frames(apart=apart), most)
        given = [frame._replace(luma=frame.luma.tobytes()) for frame in frames]
        return given, video.account


def packets(path):
    with av.open(str(path)) as container:
        return [(packet.pos, packet.size) for packet in container.demux(container.streams.video[0]) if packet.size]


def changed(path, tmp_path, **changes):
    """A copy of which some packets, given by number as `_7=...`, are changed by functions of their bytes."""
    data = bytearray(path.read_bytes())
    for number, change in changes.items():
        at, size = packets(path)[int(number[1:])]
        data[at : at + size] = change(bytes(data[at : at + size])).ljust(size, b"\0")[:size]
    copy = tmp_path / path.name
    copy.write_bytes(data)
    return copy


def noisy(packet):
    noise = np.random.default_rng(3).integers(0, 256, 100, dtype=np.uint8).tobytes()
    return packet[: len(packet) // 2] + noise + packet[len(packet) // 2 + 100 :]


def without(marker):
    def cut(packet):
        at, parts = 2, [packet[:2]]
        while packet[at + 1] != 0xDA:
            end = at + 2 + int.from_bytes(packet[at + 2 : at + 4])
            if packet[at + 1] != marker:
                parts.append(packet[at:end])
            at = end
        return b"".join([*parts, packet[at:]])

    return cut


@pytest.mark.parametrize("name", ["film.mov", "film.avi", "film.mkv"])
def test_processes_give_what_one_pass_gives(film, readers, name):
    whole = read(film(name), 1)
    assert not readers
    for threads in (2, 3):
        assert read(film(name), threads) == whole
        assert len(readers) == threads
        readers.clear()
    assert len(whole[0]) == N


@pytest.mark.parametrize("which", [0, 1, STRETCH - 1, STRETCH, 13, N - 1])
@pytest.mark.parametrize("change", [noisy, without(0xC4), without(0xDB), lambda packet: b""])
def test_so_they_do_of_a_damaged_recording(film, tmp_path, readers, which, change):
    path = changed(film(), tmp_path, **{f"_{which}": change})
    assert read(path, 2) == read(path, 1)


def test_a_picture_without_tables_of_its_own_is_read_by_those_before_it(film, tmp_path, readers):
    path = changed(film(), tmp_path, **{f"_{STRETCH}": without(0xC4)})
    assert read(path, 2) == read(path, 1)
    assert len(readers) == 2
    assert all(reader._process == 0 for reader in readers)


def test_a_recording_that_is_cut_off_and_one_that_is_left_early(film, tmp_path, readers):
    cut = tmp_path / "cut.avi"
    cut.write_bytes(film("film.avi").read_bytes()[: packets(film("film.avi"))[17][0] + 50])
    assert read(cut, 2) == read(cut, 1)
    assert read(film(), 2, most=9) == read(film(), 1, most=9)
    assert all(reader._process == 0 for reader in readers)


def test_pictures_of_another_size_are_left_out_by_all(tmp_path, readers):
    sizes = [make_clip(tmp_path / f"{k}.mov", "mjpeg", "yuvj420p", n=6, size=(96, 64 + 16 * k)) for k in (0, 1)]
    path = tmp_path / "two.mkv"
    with av.open(str(path), "w") as out, av.open(str(sizes[0])) as first:
        stream = out.add_stream_from_template(first.streams.video[0])
        for k in range(12):
            at, size = packets(sizes[k % 2])[k // 2]
            packet = av.Packet(sizes[k % 2].read_bytes()[at : at + size])
            packet.pts = packet.dts = k
            packet.time_base, packet.stream, packet.is_keyframe = Fraction(1, 25), stream, True
            out.mux(packet)
    assert read(path, 2) == read(path, 1)
    assert len(readers) == 2


def test_a_process_that_is_killed_ends_the_reading_with_one_line(film, readers, monkeypatch):
    pass_on = read_apart._pass_on

    def slowly(items, *how):
        """The second process is killed before its third picture, however long the first pictures take here."""

        def given():
            for k, item in enumerate(items):
                if len(readers) == 1 and k == 2:
                    time.sleep(600)
                yield item

        pass_on(given(), *how)

    monkeypatch.setattr(read_apart, "_pass_on", slowly)
    with open_video(str(film()), threads=2) as video:
        frames = video.frames(apart=True)
        next(frames)
        os.kill(readers[1]._process, signal.SIGKILL)
        with pytest.raises(VidtrackError, match=r"film\.mov: the process that decodes it was killed \(SIGKILL\)"):
            for _ in range(10 * N):
                next(frames)
    assert all(reader._process == 0 for reader in readers)


def test_where_no_process_can_be_had_one_pass_reads(film, monkeypatch):
    def refused():
        raise BlockingIOError(11, "Resource temporarily unavailable")

    whole = read(film(), 1)
    monkeypatch.setattr(os, "fork", refused)
    assert read(film(), 2) == whole


def test_recordings_whose_decoder_has_threads_keep_to_them(tmp_path, readers):
    path = make_clip(tmp_path / "film.mp4", "libx264", "yuv420p", n=6)
    assert read(path, 2) == read(path, 1)
    assert not readers


def test_shares_have_each_packet_once():
    every = [Share(k, 3) for k in range(3)]
    assert [sum(share.has(number) for share in every) for number in range(50)] == [1] * 50
    assert [number for number in range(2 * STRETCH + 2) if Share(1, 2).has(number)] == [*range(STRETCH, 2 * STRETCH)]


def test_all_pictures_may_do_without_huffmans_tables(film):
    data = film().read_bytes()
    whole = [data[at : at + size] for at, size in packets(film())][:3]
    bare = [without(0xC4)(packet) for packet in whole]
    for some, own in ((whole, True), (bare, True), ([*whole, bare[0]], False), ([*bare, whole[0]], False)):
        tables = Tables()
        for packet in some:
            tables.saw(packet)
        assert tables.own is own
    for broken in (b"", b"\xff\xd8", b"\xff\xd8\xff\xdb\0\0", without(0xDB)(whole[0]), whole[0][:200]):
        tables = Tables()
        tables.saw(broken)
        assert not tables.own


DAMAGED = {
    "prores.mov": ("prores_ks", "yuv422p10le", {}),
    "ffv1.mkv": ("ffv1", "gray", {"level": "3", "g": "1", "slicecrc": "1"}),
    "h264.mp4": ("libx264", "yuv420p", {"g": "10", "qp": "18"}),
    "mpeg2.mpg": ("mpeg2video", "yuv420p", {"b": "3M", "bf": "2"}),
}


@pytest.mark.parametrize("name", DAMAGED)
@pytest.mark.parametrize("apart", [False, True])
def test_a_damaged_recording_is_read_alike_by_any_number_of_threads(tmp_path, name, apart):
    """Which picture an error belongs to was less certain, the more threads the decoder had."""
    codec, pix_fmt, options = DAMAGED[name]
    path = make_clip(tmp_path / name, codec, pix_fmt, n=N, options=options, picture=moving_picture(pix_fmt))
    data = bytearray(path.read_bytes())
    at = len(data) // 2
    data[at : at + 300] = np.random.default_rng(1).integers(0, 256, 300, dtype=np.uint8).tobytes()
    path.write_bytes(data)
    given, account = read(path, 1, apart=apart)
    assert account.problems
    assert any(frame.corrupt for frame in given)
    for threads in (2, 5):
        assert read(path, threads, apart=apart) == (given, account)


def moving_picture(pix_fmt):
    picture = moving_ball(96, 64, speed=0.4)
    return (lambda i: picture(i).astype(np.uint16) * 4) if pix_fmt.endswith("10le") else picture


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "size"),
    [("tape.dv", "dvvideo", "yuv411p", (720, 480)), ("disc.mov", "mpeg2video", "yuv420p", (96, 64))],
)
@pytest.mark.parametrize("change", [None, noisy])
def test_a_quick_decoder_works_in_a_process_of_its_own_and_gives_the_same(
    tmp_path, readers, name, codec, pix_fmt, size, change
):
    path = make_clip(tmp_path / name, codec, pix_fmt, n=9, size=size, picture=moving_ball(*size, speed=0.4))
    if change is not None:
        (tmp_path / "copy").mkdir()
        path = changed(path, tmp_path / "copy", _3=change)
    whole = read(path, 1, apart=False)
    assert not readers
    assert read(path, 1) == whole
    assert len(readers) == 1
    assert all(reader._process == 0 for reader in readers)
    assert read(path, 1, most=4)[0] == whole[0][:4]
    assert all(reader._process == 0 for reader in readers)
    if change is not None:
        assert whole[1].problems


def test_without_another_process_a_quick_decoder_works_beside(tmp_path, monkeypatch):
    def none(*arguments):
        raise OSError("no more processes")

    path = make_clip(tmp_path / "tape.dv", "dvvideo", "yuv411p", n=4, size=(720, 480))
    whole = read(path, 1, apart=False)
    monkeypatch.setattr(shares, "ReadApart", none)
    assert read(path, 1) == whole


def test_the_process_of_a_quick_decoder_goes_on_with_the_file_that_is_open(tmp_path, readers):
    path = make_clip(tmp_path / "tape.dv", "dvvideo", "yuv411p", n=12, size=(720, 480))
    whole = read(path, 1, apart=False)
    with open_video(str(path), threads=1) as video:
        path.unlink()
        given = [frame._replace(luma=frame.luma.tobytes()) for frame in video.frames(apart=True)]
        with pytest.raises(ValueError, match="reads a recording once"):
            next(video.frames(apart=True))
    assert len(readers) == 1
    assert given == whole[0]

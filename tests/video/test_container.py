import os
import resource
import struct
import zlib
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.files.clips import make_clip, moving_ball, video_frame
from vidtrack.errors import VidtrackError
from vidtrack.video.container import picture_stream
from vidtrack.video.reader import open_video
from vidtrack.video.sound import sound_tracks
from vidtrack.video.times.time_source import find_time

RATE = Fraction(25)


@pytest.mark.parametrize("name", ["a.avi", "a.mov", "a.mkv", "a.mp4"])
def test_a_title_in_latin_1_is_no_hindrance(tmp_path, name):
    path = tmp_path / name
    with av.open(str(path), "w") as out:
        out.metadata["title"] = "Pruefstand@"
        stream = out.add_stream("mjpeg", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        for i in range(4):
            frame = video_frame(moving_ball(64, 48)(i), "yuvj420p")
            frame.pts, frame.time_base = i, 1 / RATE
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    data = path.read_bytes()
    assert b"Pruefstand@" in data
    path.write_bytes(data.replace(b"Pruefstand@", "Pruefstandä".encode("latin-1")))
    with open_video(str(path)) as video:
        assert len(list(video.frames())) == 4
        assert find_time(str(path), video.info).problems == ()
    assert sound_tracks(str(path)) == 0


def test_a_fragmented_recording_that_is_cut_off_is_read_to_its_last_picture(tmp_path):
    """Its sound lies behind the pictures of each fragment: its first missing packet ended the reading."""
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w", options={"movflags": "frag_keyframe+empty_moov", "frag_duration": "4000000"}) as out:
        stream = out.add_stream("libx264", rate=RATE, options={"g": "100", "bf": "0", "qp": "10"})
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
        track = out.add_stream("aac", rate=48000, layout="mono")
        for i in range(100):
            frame = video_frame(moving_ball(160, 120)(i), "yuv420p")
            frame.pts, frame.time_base = i, 1 / RATE
            out.mux(stream.encode(frame))
            noise = np.random.default_rng(i).normal(0, 9000, (1, 1920)).astype(np.int16)
            sound = av.AudioFrame.from_ndarray(noise, "s16", "mono")
            sound.sample_rate, sound.pts, sound.time_base = 48000, 1920 * i, Fraction(1, 48000)
            out.mux(track.encode(sound))
        out.mux(stream.encode())
        out.mux(track.encode())
    with av.open(str(path)) as container:
        ends = [packet.pos + packet.size for packet in container.demux(video=0) if packet.size]
    path.write_bytes(path.read_bytes()[: ends[79]])
    with open_video(str(path)) as video:
        assert len(list(video.frames())) >= 80


def two_streams(path: Path, *, cover: bool) -> Path:
    with av.open(str(path), "w") as out:
        streams = [out.add_stream("mjpeg", rate=RATE) for _ in range(2)]
        for stream, size in zip(streams, [(64, 48), (96, 64)], strict=True):
            stream.width, stream.height, stream.pix_fmt = *size, "yuvj420p"
        for i in range(5):
            for k, stream in enumerate(streams):
                if cover and k == 0 and i:
                    continue
                frame = video_frame(moving_ball(stream.width, stream.height)(i), "yuvj420p")
                frame.pts, frame.time_base = i, 1 / RATE
                out.mux(stream.encode(frame))
        for stream in streams:
            out.mux(stream.encode())
    return path


def test_a_second_stream_of_pictures_is_said(tmp_path):
    with open_video(str(two_streams(tmp_path / "a.mkv", cover=False))) as video:
        list(video.frames())
        assert video.account.problems == (
            "2 streams of pictures (64 x 48, 96 x 64); number 1 of them is read (set stream: to choose)",
        )


def test_a_stream_is_chosen_by_its_number(tmp_path):
    path = str(two_streams(tmp_path / "a.mkv", cover=False))
    for number, size in ((1, (64, 48)), (2, (96, 64))):
        with open_video(path, stream=number) as video:
            assert (video.info.width, video.info.height) == size
            list(video.frames())
            assert video.account.problems == ()
    with pytest.raises(VidtrackError, match="has 2 streams of pictures, and stream is 3"):
        open_video(path, stream=3)


class Stream:
    """As much of a stream of PyAV as is looked at."""

    type, codec_context, discard = "video", object(), None

    def __init__(self, disposition, size=(64, 48)):
        self.disposition, (self.width, self.height) = av.stream.Disposition(disposition), size


class Container:
    def __init__(self, streams, brand):
        class Streams(list):
            video = streams

        self.streams, self.metadata = Streams(streams), {"major_brand": brand}


def test_the_picture_of_a_cover_is_no_recording():
    cover, film = Stream(av.stream.Disposition.attached_pic), Stream(0)
    assert picture_stream(Container([cover, film], "isom"), "a.mp4") == (film, "")
    assert cover.discard == av.stream.Discard.all


def test_a_still_in_tiles_is_refused():
    with pytest.raises(VidtrackError, match="12 tiles"):
        picture_stream(Container([Stream(0) for _ in range(12)], "heic"), "a.heic")


PLAYLISTS = {
    "hls": "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\na.mp4\n#EXT-X-ENDLIST\n",
    "hls with a byte order mark": "\ufeff#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\na.mp4\n#EXT-X-ENDLIST\n",
    "concat": "ffconcat version 1.0\nfile a.mp4\n",
    "sdp": "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 5004 RTP/AVP 96\n",
    "dash": '<?xml version="1.0"?>\n<MPD xmlns="urn:mpeg:dash:schema:mpd:2011" type="static"><Period/></MPD>\n',
    "smooth": '<?xml version="1.0"?>\n<SmoothStreamingMedia MajorVersion="2"/>\n',
    "asx": "<asx version=\"3.0\"><entry><ref href='a.mp4'/></entry></asx>\n",
    "pls": "[playlist]\nFile1=a.mp4\n",
}


@pytest.mark.parametrize("kind", PLAYLISTS)
@pytest.mark.parametrize("ending", ["mov", "mp4", "ts", "avi"])
def test_a_list_of_other_files_is_refused_whatever_its_ending(tmp_path, kind, ending):
    make_clip(tmp_path / "a.mp4", "libx264", "yuv420p")
    path = tmp_path / f"cam1.{ending}"
    path.write_text(PLAYLISTS[kind], encoding="utf-8")
    with pytest.raises(VidtrackError, match="a list of other files or addresses") as refused:
        open_video(str(path))
    assert len(refused.value.problems) == 1


def test_a_name_that_looks_like_a_pattern_opens_no_other_file(tmp_path):
    for name, level in (("cam%02d.png", 40), ("cam01.png", 90)):
        (tmp_path / name).write_bytes(png(64, 48, level=level))
    with open_video(str(tmp_path / "cam%02d.png")) as video:
        assert [int(frame.luma[0, 0]) for frame in video.frames()] == [40]
    (tmp_path / "cam%02d.png").unlink()
    with pytest.raises(VidtrackError, match="no such file"):
        open_video(str(tmp_path / "cam%02d.png"))


def png(width, height, *, level=0, rows=None, bits=8, kind=0):
    """A PNG of one level; with fewer rows of pixels than its header claims, if asked."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    row = b"\0" + bytes([level]) * (width * {0: 1, 2: 3, 6: 4}[kind] * bits // 8)
    packer = zlib.compressobj(9)
    data = b"".join(packer.compress(row) for _ in range(height if rows is None else rows)) + packer.flush()
    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(100_000, 100_000), (16_000, 16_000), (200_000, 700)])
def test_a_header_that_claims_a_giant_is_refused_in_one_line(tmp_path, size):
    path = tmp_path / "cam1.png"
    path.write_bytes(png(*size, rows=10, bits=16, kind=6))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(VidtrackError, match="its header claims pictures of") as refused:
        open_video(str(path))
    assert len(refused.value.problems) == 1
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # KiB


def test_a_video_whose_header_claims_a_giant_is_refused_in_one_line(tmp_path):
    path = make_clip(tmp_path / "a.avi", "mjpeg", "yuvj420p")
    data = path.read_bytes()
    place = data.index(b"strf") + 12  # BITMAPINFOHEADER: size, width, height
    path.write_bytes(data[:place] + struct.pack("<ii", 100_000, 100_000) + data[place + 8 :])
    with open_video(str(path)) as video:  # the coded pictures say their own size, and that counts
        assert (video.info.width, video.info.height) == (160, 120)
    raw = make_clip(tmp_path / "raw.avi", "rawvideo", "gray", size=(160, 120))
    data = raw.read_bytes()
    place = data.index(b"strf") + 12
    raw.write_bytes(data[:place] + struct.pack("<ii", 100_000, 100_000) + data[place + 8 :])
    with pytest.raises(VidtrackError, match="its header claims pictures of no size"):
        open_video(str(raw))


def test_a_folder_or_a_pipe_is_no_recording(tmp_path):
    os.mkfifo(tmp_path / "cam1.mov")
    for path in (tmp_path, tmp_path / "cam1.mov"):  # reading a pipe would wait for ever
        with pytest.raises(VidtrackError, match="no file but a folder or a device"):
            open_video(str(path))

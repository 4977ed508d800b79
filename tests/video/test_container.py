from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from tests.files.clips import moving_ball, video_frame
from vidtrack.errors import VidtrackError
from vidtrack.video.container import picture_stream
from vidtrack.video.reader import open_video
from vidtrack.video.sound import sound_tracks
from vidtrack.video.time_source import find_time

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
        assert video.account.problems == ("2 streams of pictures (64 x 48, 96 x 64); number 1 of them is read",)


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

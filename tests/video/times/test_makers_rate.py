"""The rate at which pictures were taken, as makers write it into files that are played at another."""

from fractions import Fraction

import av
import numpy as np
import pytest

from tests.video.times.test_makers_readout import atom
from vidtrack.video.times.makers_rate import makers_rate, rate_finding


def film(path, **metadata):
    """Five pictures at 30 a second."""
    with av.open(str(path), "w", options={"movflags": "use_metadata_tags"}) as container:
        container.metadata.update(metadata)
        stream = container.add_stream("mpeg4", rate=Fraction(30))
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for k in range(5):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.full((48, 64, 3), 40 * k, np.uint8))))
        container.mux(stream.encode(None))
    return str(path)


def test_slow_motion_of_a_phone_says_at_what_rate_it_was_taken(tmp_path):
    path = film(tmp_path / "a.mp4", **{"com.android.capture.fps": "120.000000"})
    assert makers_rate(path).rate == pytest.approx(120)
    (finding,) = rate_finding(path, 30.0, "pluck")
    assert (finding.level, finding.code) == ("bad", "taken-at-another-rate")
    assert "taken at 120 a second (com.android.capture.fps in the file) and are stored at 30" in finding.text
    assert "4 times too long" in finding.text
    assert "runs.pluck.rate: 120" in finding.cure


def test_time_lapse_is_too_short(tmp_path):
    (finding,) = rate_finding(film(tmp_path / "a.mp4", **{"com.android.capture.fps": "3"}), 30.0, "a")
    assert "10 times too short" in finding.text


@pytest.mark.parametrize("said", ["30.0", "24", "nan", "fast", "0", "1e9"])
def test_the_same_rate_dim_light_and_no_rate_at_all_are_no_finding(tmp_path, said):
    assert rate_finding(film(tmp_path / "a.mp4", **{"com.android.capture.fps": said}), 30.0, "a") == []


def test_a_sony_says_it_in_its_xml(tmp_path):
    path = tmp_path / "C0001.MP4"
    xml = b'<VideoFrame videoCodec="AVC" captureFps="119.88p" formatFps="29.97p"/>'
    path.write_bytes(atom(b"ftyp", b"XAVC" + bytes(4)) + atom(b"mdat", bytes(99)) + atom(b"meta", bytes(30), xml))
    assert makers_rate(str(path)) == (119.88, "Sony's captureFps")


def with_sound(path, pictures, seconds):
    """So many pictures at 30 a second, and sound of so many seconds."""
    with av.open(str(path), "w") as container:
        video, audio = container.add_stream("mpeg4", rate=Fraction(30)), container.add_stream("aac", rate=16000)
        video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
        for k in range(pictures):
            container.mux(video.encode(av.VideoFrame.from_ndarray(np.full((48, 64, 3), k, np.uint8))))
        container.mux(video.encode(None))
        silence = av.AudioFrame.from_ndarray(np.zeros((1, int(16000 * seconds)), np.float32), "fltp", "mono")
        silence.sample_rate = 16000
        container.mux(audio.encode(silence))
        container.mux(audio.encode(None))
    return str(path)


def test_pictures_four_times_as_long_as_their_sound_may_be_slow_motion(tmp_path):
    (finding,) = rate_finding(with_sound(tmp_path / "a.mp4", 240, 2.0), 30.0, "a")
    assert (finding.level, finding.code) == ("doubtful", "taken-at-another-rate")
    assert "4 times less" in finding.text
    assert "taken at 120 a second" in finding.text
    for pictures, seconds in ((60, 2.0), (60, 6.0), (100, 2.0), (30, 0.2)):
        assert rate_finding(with_sound(tmp_path / "b.mp4", pictures, seconds), 30.0, "a") == []


@pytest.mark.parametrize("data", [b"", b"ftyp", bytes(64), b"\0\0\0\1ftyp" + b"\xff" * 40])
def test_what_says_nothing_is_passed_over(tmp_path, data):
    path = tmp_path / "a.mp4"
    path.write_bytes(data)
    assert makers_rate(str(path)) is None
    assert makers_rate(film(tmp_path / "b.mp4")) is None

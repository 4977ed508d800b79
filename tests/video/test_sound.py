from fractions import Fraction

import numpy as np
import pytest

from tests.files.clips import make_clip
from vidtrack.video.reader import open_video
from vidtrack.video.sound import sound_blocks, sound_tracks

FS = 48_000
CLICK = 20_000


def clicks(n: int = 3 * FS) -> np.ndarray:
    """A short pulse every 20,000 samples."""
    samples = np.zeros(n)
    samples[CLICK::CLICK] = 0.8
    return samples


@pytest.mark.parametrize(
    ("name", "codec", "sound_codec", "sound_start"),
    [
        ("a.mov", "mjpeg", "pcm_s16le", 0),
        ("a.mkv", "mjpeg", "pcm_s16le", 0),
        ("late.mkv", "mjpeg", "pcm_s16le", 7211),
        ("a.avi", "mjpeg", "pcm_s16le", 0),
        ("flac.mkv", "mjpeg", "flac", 0),
        ("a.mpg", "mpeg2video", "mp2", 0),
        ("a.mp4", "libx264", "aac", 0),
    ],
)
def test_sounds_are_where_their_time_stamps_say(tmp_path, name, codec, sound_codec, sound_start):
    pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    path = make_clip(
        tmp_path / name, codec, pix_fmt, n=90, sound=clicks(), sound_codec=sound_codec, sound_start=sound_start
    )
    with open_video(str(path)) as video:
        start = video.info.start
    assert sound_tracks(str(path)) == 1
    at = []
    for block in sound_blocks(str(path), 0, start=start, seconds=1.0):
        loud = np.flatnonzero(np.abs(block.samples[:, 0]) > 0.3)
        at += (block.time + loud / block.rate).tolist()
    expected = (sound_start + np.arange(CLICK, 3 * FS, CLICK)) / FS
    nearest = np.abs(np.array(at)[:, None] - expected).min(axis=0)
    assert nearest.max() < 0.0003  # a hundredth of a frame


def test_blocks_are_short_follow_on_and_hold_every_sample(tmp_path):
    sound = np.random.default_rng(0).uniform(-0.9, 0.9, (2, 3 * FS))
    path = make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=90, sound=sound)
    blocks = list(sound_blocks(str(path), 0, seconds=0.5))
    assert max(len(block.samples) for block in blocks) < 0.6 * FS
    assert [block.follows for block in blocks] == [False] + [True] * (len(blocks) - 1)
    np.testing.assert_allclose(np.concatenate([block.samples for block in blocks]), sound.T, atol=1.5 / 32767)


def test_a_recording_without_sound_has_no_tracks(tmp_path):
    assert sound_tracks(str(make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=2))) == 0


def test_the_start_of_the_picture_is_zero_for_the_sound_too(tmp_path):
    path = make_clip(tmp_path / "a.mov", "mjpeg", "yuvj420p", n=30, sound=clicks(FS))
    plain, moved = (next(sound_blocks(str(path), 0, start=start)).time for start in (Fraction(0), Fraction(1, 4)))
    assert plain - moved == pytest.approx(0.25)

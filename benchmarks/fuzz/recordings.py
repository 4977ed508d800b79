"""Recordings of every kind that is read, small and healthy, and how the program reads them."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks.fuzz.reader import Reader
from tests.files.clips import make_clip
from tests.video.pictures import SIZE, cine, levels, ser, tiff, write_mraw
from tests.video.stills.test_heic_tiles import ball, heic
from vidtrack.simulate.ltc import ltc_signal
from vidtrack.timing.timecode import parse
from vidtrack.video.reader import open_video
from vidtrack.video.sound import sound_blocks, sound_tracks
from vidtrack.video.times.time_source import find_time

MOST = 2000
"""Pictures of a recording of a few: more is a reader that does not end."""

CLIPS = {
    "cam1.mp4": ("libx264", "yuv420p"),
    "cam1.mkv": ("ffv1", "gray"),
    "cam1.avi": ("mjpeg", "yuvj420p"),
    "cam1.mpg": ("mpeg2video", "yuv420p"),
    "cam1.ts": ("libx264", "yuv420p"),
    "cam1.mov": ("prores_ks", "yuv422p10le"),
    "cam1.mxf": ("mpeg2video", "yuv422p"),
    "cam1.webm": ("libvpx", "yuv420p"),
    "cam1.gif": ("gif", "gray"),
}
PICTURES = ("cam1.png", "cam1.jpg", "cam1.bmp", "cam1.webp", "cam1.pgm")


def read(path: str) -> None:
    """All pictures, the time code, the account and the sound."""
    with open_video(path) as video:
        find_time(path, video.info)
        for count, frame in enumerate(video.frames()):
            frame.luma.max()
            assert count < MOST, "does not end"
        problems = video.account.problems
        start = video.info.start
    for track in range(sound_tracks(path)):
        for block in sound_blocks(path, track, start=start):
            block.samples.max(initial=0.0)
    assert all("\n" not in line for line in problems), "a line that is none"


def _clip(kind: str, folder: Path) -> Path:
    codec, pix_fmt = CLIPS[kind]
    picture = partial(levels, bits=10 if "10" in pix_fmt else 8)
    return make_clip(folder / kind, codec, pix_fmt, n=6, size=SIZE, picture=picture)


def _with_sound(folder: Path) -> Path:
    """With time code in its sound and in a track."""
    first = parse("10:00:00:00", Fraction(30000, 1001))
    samples = ltc_signal(np.arange(24_000) / 48_000, first)
    how = {"n": 12, "size": SIZE, "picture": levels, "timecode": "10:00:00:00"}
    return make_clip(folder / "cam1.code.mov", "mjpeg", "yuvj420p", **how, sound=samples)


def _written(name: str, data: Callable[[], bytes], folder: Path) -> Path:
    (folder / name).write_bytes(data())
    return folder / name


def _picture(name: str, folder: Path) -> Path:
    Image.fromarray(levels(0)).save(folder / name)
    return folder / name


def _numbered(folder: Path) -> Path:
    for k in range(3):
        Image.fromarray(levels(k)).save(folder / f"n_{k:03d}.png")
    return folder / "n_001.png"


def _mraw(name: str, xml: bool, folder: Path) -> Path:
    write_mraw(folder / "cam1.mraw", 3, stored=8, effective=8, rate=100, xml=xml)
    return folder / name


def _numbered_read(path: str) -> None:
    with open_video(path, numbered=True) as video:
        for frame in video.frames():
            frame.luma.max()


READERS: dict[str, Reader] = {
    **{kind: Reader(partial(_clip, kind), read) for kind in CLIPS},
    **{kind: Reader(partial(_picture, kind), read) for kind in PICTURES},
    "cam1.code.mov": Reader(_with_sound, read),
    "cam1.tif": Reader(partial(_written, "cam1.tif", lambda: tiff([levels(i) for i in range(3)])), read),
    "stack.tif": Reader(
        partial(
            _written,
            "stack.tif",
            lambda: tiff([levels(i) for i in range(3)], imagej="ImageJ=1.53\nimages=3\nfps=25\n"),
        ),
        read,
    ),
    "cam1.cine": Reader(partial(_written, "cam1.cine", lambda: cine([0.0, 0.01, 0.021])), read),
    "cam1.ser": Reader(partial(_written, "cam1.ser", lambda: ser([0.0, 0.01, 0.021])), read),
    "cam1.mraw": Reader(partial(_mraw, "cam1.mraw", False), read),
    "cam1.cih": Reader(partial(_mraw, "cam1.cih", False), read, text=True, file="cam1.mraw"),
    "cam1.cihx": Reader(partial(_mraw, "cam1.cihx", True), read, text=True, file="cam1.mraw"),
    "cam1.heic": Reader(lambda folder: heic(folder, ball(64.2, 63.7, 8)), read),
    "numbered png": Reader(_numbered, _numbered_read, file="n_000.png"),
}
"""By the name of the file that is mutated."""

"""Recordings: every picture of a video, a still image or numbered pictures, in order, with its own time.

with open_video("runs/pluck/cam1.mov") as video:
    for frame in video.frames():
        frame.luma          # a view of the decoder's picture, levels as stored
video.account               # how the reading went
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from vidtrack.errors import VidtrackError
from vidtrack.timing.timecode import exact_rate
from vidtrack.video.decoded import DecodedVideo
from vidtrack.video.joined import JoinedVideo
from vidtrack.video.recording import Video
from vidtrack.video.stills.heic_tiles import HeicTiles, is_tiled
from vidtrack.video.stills.mraw import MrawPictures
from vidtrack.video.stills.numbered import NumberedPictures
from vidtrack.video.stills.picture_stack import PictureStack
from vidtrack.video.stills.tiff_pages import TiffPages, page_count

USUAL = 300
"""Pictures a second below which rates are known by their rounded values."""


def _given(rate: Fraction | float | None) -> Fraction | None:
    """The exact rate that a person means: 29.97 is 30000/1001, but 1000.1 is no rounded 1000."""
    if rate is None:
        return None
    return exact_rate(rate) if rate < USUAL else Fraction(rate).limit_denominator(1_000_000)


def open_video(
    path: str,
    threads: int = 1,
    *,
    rate: Fraction | float | None = None,
    stream: int | None = None,
    parts: Sequence[str] = (),
    numbered: bool = False,
    colour: Any = None,
) -> Video:
    """Open a recording; a still image is one of one frame.

    path      its file, or the first of its files
    threads   of the decoder, 0 for as many as there are processors; when several videos are read side by side, one
              each is best
    rate      pictures a second that the camera took, where the file states another or none: times follow it
    stream    which of several streams of pictures is read, 1 for the first
    parts     the files that go on where `path` ends, as paths from its folder
    numbered  whether `path` is the first of numbered pictures in its folder
    colour    what makes levels of colours, as `video.colour` says; None: luma
    Reading ahead (`frames(ahead=True)`) lowers Python's switch interval for the whole process while it runs.
    Raises VidtrackError naming the file when it is missing, empty, no video, or has no picture that can be decoded.
    """
    path, given = str(path), _given(rate)
    if numbered:
        return PictureStack(NumberedPictures(path, colour), given)
    if parts:
        folder = os.path.dirname(path)
        paths = [path, *(os.path.join(folder, part) for part in parts)]
        return JoinedVideo(paths, lambda one: open_video(one, threads, rate=given, stream=stream, colour=colour))
    ending = os.path.splitext(path)[1].lower()
    if ending == ".mraw" and os.path.isfile(path):
        if colour is not None:
            raise VidtrackError(f"{path}: detect.colour is set, and the pictures are grey. Remove detect.colour.")
        return PictureStack(MrawPictures(path), given)
    if ending in (".tif", ".tiff") and os.path.isfile(path) and page_count(path) > 1:
        return PictureStack(TiffPages(path, colour), given)
    if is_tiled(path):
        return PictureStack(HeicTiles(path, colour), given)
    return DecodedVideo(path, threads, given, stream, colour)

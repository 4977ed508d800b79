"""Files that hold recordings: opened, or told why not, and the stream of pictures that is meant."""

from __future__ import annotations

from typing import Any

import av
from av.stream import Discard, Disposition

from vidtrack.errors import VidtrackError


def open_container(path: str) -> Any:
    """The open file; VidtrackError that says why it cannot be opened.

    Text in it that is no UTF-8 (titles of old programs are Latin-1) is no hindrance.
    """
    try:
        return av.open(f"file:{path}", metadata_errors="replace")
    except FileNotFoundError:
        raise VidtrackError(f"{path}: no such file. Check the name, or put the recording there.") from None
    except (av.error.FFmpegError, OSError) as error:
        raise VidtrackError(f"{path}: {_why_not_opened(path, error)}") from None


def _why_not_opened(path: str, error: Exception) -> str:
    try:
        with open(path, "rb") as file:
            head = file.read(12)
    except OSError as refused:
        return f"cannot be read ({refused.strerror}). Check that it is a file and may be read."
    if not head:
        return "is empty (0 bytes). Copy the recording again."
    if head[4:8] in (b"ftyp", b"mdat", b"wide", b"free"):
        return (
            "an MP4 or MOV without its index (moov): the recorder was stopped before it closed the file. "
            "Copy it again, or rebuild it with a repair tool."
        )
    return f"not a video or image that can be read ({getattr(error, 'strerror', None) or error})."


def picture_stream(container: Any, path: str) -> tuple[Any, str]:
    """The stream of pictures that is read, and what should be known of others; all other streams are left unread.

    Pictures of a cover are no recording. Where there are several streams, the one that the file names its default, or
    else the first.
    Raises VidtrackError where there is none, and for a still that is stored in tiles, a stream each.
    """
    streams = [stream for stream in container.streams.video if stream.codec_context is not None]
    pictures = [stream for stream in streams if not stream.disposition & Disposition.attached_pic] or streams
    if not pictures:
        found = ", ".join(sorted({stream.type for stream in container.streams})) or "nothing"
        raise VidtrackError(f"{path}: holds no pictures, only {found}. Give the file that has the video.")
    chosen = next((stream for stream in pictures if stream.disposition & Disposition.default), pictures[0])
    if len(pictures) > 2 and _is_heic(container):
        raise VidtrackError(
            f"{path}: a picture in {len(pictures)} tiles (HEIC), of which one alone would be read. "
            "Save it as PNG or JPEG."
        )
    for stream in container.streams:
        if stream is not chosen:
            # where a recording is cut off, the first packet of sound that is missing would end it
            stream.discard = Discard.all
    if len(pictures) == 1:
        return chosen, ""
    sizes = ", ".join(f"{stream.width} x {stream.height}" for stream in pictures)
    return chosen, f"{len(pictures)} streams of pictures ({sizes}); number {pictures.index(chosen) + 1} of them is read"


def _is_heic(container: Any) -> bool:
    return container.metadata.get("major_brand", "").strip() in ("heic", "heix", "mif1", "heim", "heis", "avif")

"""Files that hold recordings: opened, or refused with the reason, and the stream of pictures that is read."""

from __future__ import annotations

import os
from typing import Any

import av
from av.stream import Discard, Disposition

from vidtrack.errors import VidtrackError

FORMATS = frozenset(
    """
    3dostr apng asf asf_o av1 avi avs2 avs3 bmp_pipe cavsvideo cine cri_pipe dds_pipe dhav dirac dnxhd dpx_pipe dv evc
    exr_pipe fits flic flv gem_pipe gif gxf h261 h263 h264 hdr_pipe hevc idcin ifv image2 ipu iv8 ivf j2k_pipe jpeg_pipe
    jpegls_pipe jpegxl_anim jpegxl_pipe jpegxs_pipe kux live_flv lmlm4 lvf lxf m4v matroska mgsts mjpeg mjpeg_2000 mlv
    mov mp3 mpeg mpegts mpegvideo mpjpeg mtv mxf mxf_opatom nsv nut nuv obu ogg pam_pipe pbm_pipe pcx_pipe pfm_pipe
    pgm_pipe pgmyuv_pipe pgx_pipe phm_pipe png_pipe ppm_pipe psd_pipe pva qoi_pipe r3d rm ser sgi_pipe smjpeg
    sunrast_pipe tiff_pipe ty vc1 vc1test vvc wav webp webp_pipe wtv xbm_pipe xpm_pipe xwd_pipe yuv4mpegpipe
    """.split()  # noqa: SIM905
)
"""Names that libavformat has for containers that hold their pictures themselves. Playlists, session descriptions and
device names are not among them: a recording never names another file or an address."""

MOST_PIXELS = 120_000_000
"""Of a picture. More is no camera's but a damaged or a hostile header: with 16 bits in four channels it is 1 GB."""

_LISTS = (
    b"#extm3u",
    b"ffconcat",
    b"v=0",
    b"[playlist]",
    b"[reference]",
    b"<asx",
    b"<smil",
    b"<mpd",
    b"<smoothstreaming",
)
"""How files begin that list other files or addresses, in small letters."""


def open_container(path: str) -> Any:
    """The open file; VidtrackError that says why it cannot be opened.

    No other file and no address is opened, whatever the file names. Text in it that is no UTF-8 (titles of old
    programs are Latin-1) is no hindrance.
    """
    if not os.path.lexists(path):
        raise VidtrackError(f"{path}: no such file. Check the name, or put the recording there.")
    if os.path.exists(path) and not os.path.isfile(path):
        raise VidtrackError(f"{path}: no file but a folder or a device. Name the recording's file.")
    options = {
        "format_whitelist": ",".join(sorted(FORMATS)),
        "protocol_whitelist": "file",
        "pattern_type": "none",
        "max_pixels": str(MOST_PIXELS),
    }
    try:
        return av.open(f"file:{path}", options=options, metadata_errors="replace")
    except FileNotFoundError:
        raise VidtrackError(f"{path}: no such file. Check the name, or put the recording there.") from None
    except (av.error.FFmpegError, OSError) as error:
        raise VidtrackError(f"{path}: {_why_not_opened(path, error)}") from None


def refuse_giants(path: str, width: int, height: int) -> None:
    """VidtrackError where a header claims a picture that no camera makes."""
    if width * height > MOST_PIXELS:
        raise VidtrackError(f"{path}: its header claims pictures of {width} x {height}, {_GIANT}")


_GIANT = (
    f"more than {MOST_PIXELS // 1_000_000} million pixels: it is damaged, or no recording. Copy it again, or make its "
    "pictures smaller."
)


def why_no_picture(said: str) -> str:
    """What to say of a file of which no picture can be decoded.

    said  " (what the decoder said)", or nothing
    """
    if "is not set" in said:
        return f"its header claims pictures of no size, or of {_GIANT}"
    if "max pixel count" in said or "image size" in said or "Picture size" in said:
        return f"its header claims pictures of {_GIANT}"
    return f"no picture in it can be decoded. Is the file whole?{said}"


def _why_not_opened(path: str, error: Exception) -> str:
    try:
        with open(path, "rb") as file:
            head = file.read(512)
    except OSError as refused:
        return f"cannot be read ({refused.strerror}). Check that it is a file and may be read."
    if not head:
        return "is empty (0 bytes). Copy the recording again."
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if start.startswith(_LISTS) or (start.startswith(b"<?xml") and any(kind in start for kind in _LISTS)):
        return "a list of other files or addresses, not a recording. Give the recording itself."
    if head[4:8] in (b"ftyp", b"mdat", b"wide", b"free"):
        return (
            "an MP4 or MOV without its index (moov): the recorder was stopped before it closed the file. "
            "Copy it again, or rebuild it with a repair tool."
        )
    if isinstance(error, av.error.ArgumentError):
        return "of a kind that is no recording. Give a video, or pictures."
    why = getattr(error, "strerror", None) or error
    return f"not a video or image that can be read ({why}). Copy the recording again, or save it in another format."


def picture_stream(container: Any, path: str, number: int | None = None) -> tuple[Any, str]:
    """The stream of pictures that is read, and what to know of the others; all other streams are left unread.

    Pictures of a cover are no recording. Where there are several streams, the one of that number (1 for the first), or
    else the one that the file names its default, or else the first.
    Raises VidtrackError where there is none, none of that number, and for a still stored in tiles, a stream each.
    """
    streams = [stream for stream in container.streams.video if stream.codec_context is not None]
    pictures = [stream for stream in streams if not stream.disposition & Disposition.attached_pic] or streams
    if not pictures:
        found = ", ".join(sorted({stream.type for stream in container.streams})) or "nothing"
        raise VidtrackError(f"{path}: holds no pictures, only {found}. Give the file that has the video.")
    for stream in pictures:
        refuse_giants(path, stream.width, stream.height)
    chosen = next((stream for stream in pictures if stream.disposition & Disposition.default), pictures[0])
    if number is not None:
        if number > len(pictures):
            many = "1 stream" if len(pictures) == 1 else f"{len(pictures)} streams"
            raise VidtrackError(f"{path}: has {many} of pictures, and stream is {number}. Correct stream.")
        chosen = pictures[number - 1]
    if len(pictures) > 2 and _is_heic(container):
        raise VidtrackError(
            f"{path}: a picture in {len(pictures)} tiles (HEIC), of which one alone would be read. "
            "Save it as PNG or JPEG."
        )
    for stream in container.streams:
        if stream is not chosen:
            # where a recording is cut off, the first packet of sound that is missing would end it
            stream.discard = Discard.all
    if len(pictures) == 1 or number is not None:
        return chosen, ""
    sizes = ", ".join(f"{stream.width} x {stream.height}" for stream in pictures)
    read = pictures.index(chosen) + 1
    return (
        chosen,
        f"{len(pictures)} streams of pictures ({sizes}); number {read} of them is read (set stream: to choose)",
    )


def _is_heic(container: Any) -> bool:
    return container.metadata.get("major_brand", "").strip() in ("heic", "heix", "mif1", "heim", "heis", "avif")

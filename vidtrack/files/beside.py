"""What lies in a folder beside recordings: which files are recordings, which tables, and which are neither."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable

from vidtrack.errors import VidtrackError
from vidtrack.naming import hint_of

RECORDINGS = frozenset(
    """
    3gp asf avi avif bmp cin cine dv exr flv gif heic heif insv jfif jp2 jpeg jpg m2t m2ts m2v m4v mj2 mjpeg mjpg mkv
    mlv mov mp4 mpeg mpg mraw mts mxf nut ogv png pgm ppm qt raw h264 h265 264 265 hevc ser tif tiff ts vob webm webp
    wmv y4m
    """.split()  # noqa: SIM905
)
"""Endings that recordings and still images have. One that is not here may be a recording too, if it is named as one."""

STILLS = frozenset("bmp dng exr heic heif jfif jp2 jpeg jpg pgm png ppm tif tiff webp".split())  # noqa: SIM905
"""Endings of single pictures; several of them, numbered, are a recording."""

OTHERS = frozenset(
    """
    csv tsv txt md rst log json yaml yml toml ini cfg conf parquet feather npz npy mat h5 hdf5 pkl xls xlsx xlsm ods doc
    docx odt ppt pptx pdf htm html rtf py ipynb m r jl sh bat exe lnk url webloc db zip 7z rar tar gz md5 sha1 sha256
    sfv srt vtt ass ssa sub idx thm lrv lrf xml xmp cih cihx cif chd gpx kml fit nmea gcsv aae moi modd bdm cpi mpl tdt
    trk prn ori addpar c3d slp bin inp bup ifo edl fcpxml aep prproj drp scc ttml nfo cue m3u m3u8 pls wav mp3 aac
    m4a flac ogg wma aif aiff bak old orig tmp temp part partial crdownload download swp svg eps
    """.split()  # noqa: SIM905
)
"""Endings of files beside recordings that are none: notes, tables, sound, and what cameras and systems write."""

TRACKS = ("csv", "tsv", "txt", "h5", "hdf5", "xml", "trk", "prn", "dat")
"""Endings of tracks in place of a recording, and of calibration points in place of a clip."""

CAMERA_FILES = ("csv", "txt", "toml", "yaml", "yml", "xml", "ori", "prn")
"""Endings of a camera that another program calibrated."""

LITTER = re.compile(
    r"\..*|~.*|.*~|thumbs\.db|ehthumbs.*|desktop\.ini|icon\s*|__macosx|\$recycle\.bin|system volume information|@eadir"
    r"|lost\+found|#recycle",
    re.IGNORECASE | re.DOTALL,
)
"""Names of files and folders that systems and programs leave behind."""


def entries(folder: str) -> list[str]:
    """The names in a folder, in order, without litter; VidtrackError where it may not be read."""
    try:
        return sorted(name for name in os.listdir(folder) if not LITTER.fullmatch(name))
    except OSError as error:
        raise VidtrackError(f"{folder}: cannot be read ({error.strerror}). Correct its permissions.") from None


def may_be_recording(name: str) -> bool:
    """Whether a file's name is not that of anything else."""
    ending = os.path.splitext(name)[1].lower().removeprefix(".")
    return bool(ending) and ending not in OTHERS


def is_recording(name: str) -> bool:
    """Whether a file has an ending that recordings have."""
    return os.path.splitext(name)[1].lower().removeprefix(".") in RECORDINGS


def named_as(folder: str, names: Iterable[str], endings: Iterable[str], problems: list[str]) -> dict[str, str]:
    """The file of each name that a folder has with one of these endings; two for one name are a problem."""
    found: dict[str, str] = {}
    wanted = set(names)
    for entry in entries(folder) if os.path.isdir(folder) else ():
        stem, ending = os.path.splitext(entry)
        path = os.path.normpath(os.path.join(folder, entry))
        if stem not in wanted or ending.lower().removeprefix(".") not in endings or os.path.isdir(path):
            continue
        if trouble := broken_link(path):
            problems.append(trouble)
        elif stem in found:
            problems.append(f"{path}: camera {stem} has another file here, {found[stem]}. Keep one.")
        else:
            found[stem] = path
    return found


def is_pipe(path: str | os.PathLike[str]) -> bool:
    """Whether something is neither a file nor a folder: who opens it may wait for ever, or read without end."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def broken_link(path: str) -> str | None:
    """What is wrong with a link that leads nowhere, or a file that may not be read; None where nothing is."""
    if os.path.islink(path) and not os.path.exists(path):
        return f"{path}: a link to {os.readlink(path)!r}, which is not there. Connect the disk, or correct the link."
    if is_pipe(path):
        return f"{path}: no file but a pipe or a device. Put the file itself there."
    if os.path.exists(path) and not os.access(path, os.R_OK):
        return f"{path}: may not be read. Correct its permissions."
    return None


MEASURED = ("c3d", "tsv", "mat")
"""Endings of points that another instrument measured, in place of reference.csv and truth.csv."""


def measured_in(folder: str, stem: str, problems: list[str]) -> str | None:
    """The path of a table such as reference.csv, or of a C3D or QTM file of that name, in a folder; None without
    one."""
    if not os.path.lexists(os.path.join(folder, f"{stem}.csv")):
        found = {stem: None} | named_as(folder, [stem], MEASURED, problems)
        if found[stem]:
            return found[stem]
    return table_in(folder, f"{stem}.csv", problems)


def table_in(folder: str, name: str, problems: list[str]) -> str | None:
    """The path of a table such as points.csv in a folder, None where there is none.

    A file that is meant to be it, and is not named so, is a problem: Points.csv, picks.xlsx, target.csv.
    """
    path = os.path.normpath(os.path.join(folder, name))
    if os.path.islink(path) or os.path.isfile(path) or is_pipe(path):
        trouble = broken_link(path)
        if trouble:
            problems.append(trouble)
        return None if trouble else path
    stem = os.path.splitext(name)[0]
    for other in entries(folder) if os.path.isdir(folder) else ():
        own, ending = os.path.splitext(other)
        here = os.path.normpath(os.path.join(folder, other))
        if os.path.isdir(here):
            continue
        if own.casefold() == stem and ending.lower() in (".xlsx", ".xls", ".xlsm", ".ods"):
            problems.append(f"{here}: a spreadsheet, and only {name} is read. Save the sheet as CSV under that name.")
        elif own.casefold() in (stem, stem.removesuffix("s"), f"{stem}s", f"{stem}.csv") and ending.lower() in (
            *(".csv", ".txt", ".tsv", ".dat", ""),
        ):
            problems.append(f"{here}: only {name} is read. Rename the file to {name}, or remove it.")
    return None


def alike_but_for_case(names: list[str], where: str) -> list[str]:
    """Names that are one name where capitals do not count, as on the disks of Windows and macOS: a line for each."""
    first: dict[str, str] = {}
    problems = []
    for name in names:
        other = first.setdefault(name.casefold(), name)
        if other != name:
            problems.append(f"{where}: {other} and {name} differ in capitals alone. Rename one of them.")
    return problems


def unknown_camera(path: str, camera: str, cameras: list[str]) -> str:
    """What to do about a recording that is named after no camera."""
    hint = hint_of(camera, cameras, f"known: {', '.join(cameras)}.")
    return f"{path}: config.yaml names no camera {camera!r}; {hint}"

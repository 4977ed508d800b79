"""TrackMate: its whole XML (spots and tracks) or the shorter one of tracks alone.

Upper-left origin, y down; positions are pixel indices times the pixel's size, so that the centre of the first pixel is
(0, 0). The whole file states the size (`pixelwidth`, `spatialunits`): positions are divided by it. The shorter one
states only a unit: where it is no pixel, the file is refused. Frames from 0; `timeinterval` is used as the rate only
where the file's time unit is seconds. Tracks are numbered camera by camera. A track that splits or merges is cut
there. z is not read. Source: imagej.net/plugins/trackmate, TmXmlKeys, ExportTracksToXML.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, number
from vidtrack.exchange.tracks.digitised import Digitised, of_rows

PIXELS = ("pixel", "pixels", "px")
Row = tuple[float, str, float, float]
"""Frame, name, x, y."""
SECONDS = ("sec", "s", "second", "seconds")


def read(path: Path, root: ElementTree.Element) -> Digitised:
    """The tracks of one camera."""
    return _whole(path, root) if root.tag == "TrackMate" else _short(path, root)


def _short(path: Path, root: ElementTree.Element) -> Digitised:
    unit = root.get("spaceUnits", "pixel")
    if unit not in PIXELS:
        raise VidtrackError(
            f"{path}: positions are in {unit} of a pixel size that is not stated. Save TrackMate's whole XML."
        )
    rows: list[Row] = []
    for k, particle in enumerate(root.iter("particle")):
        for spot in particle.iter("detection"):
            rows.append((_number(path, spot, "t"), f"track{k}", _number(path, spot, "x"), _number(path, spot, "y")))
    return _digitised(path, rows, 1.0, 1.0, None, _rate(root.get("timeUnits"), root.get("frameInterval")))


def _whole(path: Path, root: ElementTree.Element) -> Digitised:
    model, image = root.find("Model"), root.find(".//ImageData")
    if model is None:
        raise VidtrackError(f"{path}: no Model in this TrackMate file. Save it after tracking.")
    wide, high = (number(image.get(name, "")) if image is not None else None for name in ("pixelwidth", "pixelheight"))
    if not wide or not high:
        if model.get("spatialunits", "pixel") not in PIXELS:
            raise VidtrackError(
                f"{path}: no pixelwidth, and positions are in {model.get('spatialunits')}. Save it again."
            )
        wide = high = 1.0
    spots = {}
    for spot in model.iter("Spot"):
        frame, x, y = (_number(path, spot, name) for name in ("FRAME", "POSITION_X", "POSITION_Y"))
        spots[spot.get("ID", "")] = frame, x, y
    rows: list[Row] = []
    for track in model.iter("Track"):
        after: dict[str, list[str]] = {}
        before: dict[str, int] = {}
        for edge in track.iter("Edge"):
            a, b = edge.get("SPOT_SOURCE_ID", ""), edge.get("SPOT_TARGET_ID", "")
            if a not in spots or b not in spots:
                raise VidtrackError(f"{path}: a track names a spot that is not there. Save it again.")
            if spots[a][0] > spots[b][0]:
                a, b = b, a
            after.setdefault(a, []).append(b)
            before[b] = before.get(b, 0) + 1
        number_of = track.get("TRACK_ID", track.get("name", str(len(rows))))
        for part, chain in enumerate(_chains(after, before)):
            name = f"track{number_of}" + (f".{part + 1}" if part else "")
            rows += [(spots[spot][0], name, *spots[spot][1:]) for spot in chain]
    size = None
    if image is not None and (w := number(image.get("width", ""))) and (h := number(image.get("height", ""))):
        size = (int(w), int(h))
    rate = _rate(model.get("timeunits"), image.get("timeinterval") if image is not None else None)
    return _digitised(path, rows, wide, high, size, rate)


def _chains(after: dict[str, list[str]], before: dict[str, int]) -> list[list[str]]:
    """The stretches of a track in which every spot has one spot after it and one before it."""
    starts = [a for a in after if before.get(a, 0) != 1]
    starts += [b for ends in after.values() if len(ends) > 1 for b in ends if before[b] == 1]
    starts += [b for b, n in before.items() if n > 1 and b not in after]
    chains = []
    for spot in dict.fromkeys(starts):
        chain = [spot]
        while len(after.get(chain[-1], ())) == 1 and before[after[chain[-1]][0]] == 1:
            chain.append(after[chain[-1]][0])
        chains.append(chain)
    return chains


def _digitised(
    path: Path,
    rows: list[Row],
    wide: float,
    high: float,
    size: tuple[int, int] | None,
    rate: float | None,
) -> Digitised:
    if not rows:
        raise VidtrackError(f"{path}: no tracks in this TrackMate file. Save it after tracking.")
    b = np.array([row[2:] for row in rows], float) / (wide, high)
    names, frame, b, twice = of_rows(path, [row[0] for row in rows], [row[1] for row in rows], b)
    if twice:
        raise VidtrackError(f"{path}: {twice} spots of one track in one frame. Save it again.")
    return Digitised("trackmate", names, frame, b, False, "upper-left", (0.0, 0.0), size, rate=rate)


def _number(path: Path, element: ElementTree.Element, name: str) -> float:
    value = number(element.get(name, ""))
    if value is None or not np.isfinite(value):
        raise VidtrackError(f"{path}: a spot has no {name}. Save it again.")
    return value


def _rate(unit: str | None, interval: str | None) -> float | None:
    seconds = number(interval or "")
    return 1 / seconds if unit in SECONDS and seconds and np.isfinite(seconds) and seconds > 0 else None

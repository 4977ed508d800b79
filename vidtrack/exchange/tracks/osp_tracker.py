"""OSP Tracker: its .trk file (XML), or a table that it exported with the columns pixelx and pixely.

Upper-left origin, y down; image coordinates count from the corner of the picture, so that the centre of the first
pixel is (0.5, 0.5); px. A step of a point mass has a picture's number, from 0; steps that were not marked are not
there. Frames that Tracker skips (step size) are not there either. The time of a frame is frame x delta_t (ms) of its
clip, where the file has one. Exported x, y are in Tracker's own world (its axes, scale and reference frame), which
no table states: only pixelx, pixely are read. Names are those of the tracks; a table has its track's name in a line
above the header. Source: OpenSourcePhysics/tracker,
PointMass.FrameData, ImageCoordSystem.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import Path, number
from vidtrack.exchange.tracks.digitised import Digitised, of_rows
from vidtrack.exchange.tracks.table import Table, numbers_of, split

FIRST = (0.5, 0.5)
HEAD = 2000
"""Characters in which a table's name and header are."""


def is_header(header: list[str]) -> bool:
    """Whether the columns are those of a table that Tracker exported."""
    names = {cell.lower() for cell in header}
    return {"pixelx", "pixely"} <= names or (names >= {"t", "x", "y"} and len(names) <= 12 and "frame" not in names)


def named_table(text: str) -> tuple[str, Table] | None:
    """A track's name and the table below it, as Tracker exports them; None where a text is no such."""
    name, _, below = text[:HEAD].lstrip("\n").partition("\n")
    if any(mark in name for mark in ",;\t") or not (heads := split(below)[0]) or not is_header(heads[0]):
        return None
    _, table = split(text.lstrip("\n").partition("\n")[2])
    return name.strip(), table._replace(line=table.line + 1)


def read_table(path: Path, table: Table, name: str = "mass_A") -> Digitised:
    """The one track of an exported table."""
    at = {cell.lower(): k for k, cell in enumerate(table.header)}
    if not {"pixelx", "pixely"} <= set(at):
        raise VidtrackError(
            f"{path}: x and y are in the world of Tracker, whose axes and scale the table does not state. Export the "
            "columns frame, pixelx and pixely, or put the .trk file there."
        )
    index = at.get("frame", at.get("step"))
    if index is None:
        raise VidtrackError(f"{path}: no column frame: which picture a row is of is not known. Export frame too.")
    values = numbers_of(path, table, [index, at["pixelx"], at["pixely"]])
    values = values[np.isfinite(values[:, 0])]
    _, frame, b, twice = of_rows(path, values[:, 0], [name] * len(values), values[:, 1:])
    if twice:
        raise VidtrackError(f"{path}: {twice} rows repeat a frame. Export one track to a table.")
    return Digitised("tracker", (name,), frame, b, True, "upper-left", FIRST)


def read_trk(path: Path, root: ElementTree.Element) -> Digitised:
    """The point masses of a .trk file."""
    names: list[str] = []
    rows: list[tuple[float, str, float, float]] = []
    for track in root.iter("object"):
        if not track.get("class", "").endswith("PointMass"):
            continue
        name = _value(track, "name") or f"mass_{len(names) + 1}"
        while name in names:
            name += "'"
        names.append(name)
        for step in track.iter("property"):
            found = _step(step)
            if found:
                rows.append((found[0], name, *found[1:]))
    if not rows:
        raise VidtrackError(f"{path}: no point mass with marked steps in this Tracker file. Save it with its tracks.")
    labels, frame, b, _ = of_rows(
        path, [row[0] for row in rows], [row[1] for row in rows], np.array([row[2:] for row in rows])
    )
    delta = number(_value(root, "delta_t") or "")
    rate = 1000.0 / delta if delta and np.isfinite(delta) and delta > 0 else None
    return Digitised("tracker", labels, frame, b, True, "upper-left", FIRST, _size(root), rate=rate)


def _step(element: ElementTree.Element) -> tuple[float, float, float] | None:
    """Frame, x and y of one marked step: a property `[n]` that holds FrameData."""
    name, data = element.get("name", ""), element.find("object")
    if not name.startswith("[") or data is None or not data.get("class", "").endswith("FrameData"):
        return None
    frame = number(name.strip("[]"))
    x, y = (number(_value(data, axis) or "") for axis in "xy")
    if frame is None or x is None or y is None or not np.isfinite([x, y]).all():
        return None
    own = number(_value(data, "n") or "")
    return (frame if own is None or not np.isfinite(own) else own, x, y)


def _size(root: ElementTree.Element) -> tuple[int, int] | None:
    """The size of the picture, where the file states it."""
    width, height = (number(_value(root, f"video_{name}") or _value(root, name) or "") for name in ("width", "height"))
    return (int(width), int(height)) if width and height and width > 1 and height > 1 else None


def _value(element: ElementTree.Element, name: str) -> str | None:
    """The text of a property that belongs to the element itself."""
    found = element.find(f"property[@name='{name}']")
    if found is None and element.tag == "object" and name in ("delta_t",):
        found = element.find(f".//property[@name='{name}']")
    return found.text if found is not None else None

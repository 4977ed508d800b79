"""Metashape: the XML of File > Export > Export Cameras, in Agisoft's own format.

f px; cx, cy px from the middle of the picture; the centre of the first pixel is (0.5, 0.5); k1 to k4, p1, p2 (the
other way round than OpenCV's), b1, b2: u = w/2 + cx + x' (f + b1) + y' b2, from undistorted to distorted. A camera's
transform leads from its axes (x right, y down, z forward) to the chunk's, the chunk's transform on to the world:
metres, right-handed; geocentric where its reference is geographic. Without a transform of the chunk the model has a
scale of its own: `camera_file.units` says what. A sensor may have an initial calibration and an adjusted one: the
adjusted one is read. A camera is chosen by its label. Source: Metashape manual, appendix D; XML of public projects.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.given import Given, Said, chosen, of_lens, rotation
from vidtrack.exchange.text import Path, number, numbers
from vidtrack.exchange.xml import parsed
from vidtrack.findings import Finding
from vidtrack.geometry.brown import BrownLens


def read(path: Path, said: Said, root: ElementTree.Element | None = None) -> Given:
    """One camera of a chunk."""
    root = parsed(path) if root is None else root
    chunk = root if root.tag == "chunk" else root.find(".//chunk")
    if chunk is None:
        raise VidtrackError(f"{path}: no chunk in this XML. Export cameras from Metashape in Agisoft XML.")
    placed = [each for each in chunk.iter("camera") if each.find("transform") is not None]
    if not placed:
        raise VidtrackError(f"{path}: no camera with a transform: none was aligned. Align the cameras first.")
    names = [os.path.splitext(each.get("label", each.get("id", "?")))[0] for each in placed]
    own = placed[chosen(names, said, path)]
    sensor = next((s for s in chunk.iter("sensor") if s.get("id") == own.get("sensor_id")), None)
    part = calibration_of(sensor) if sensor is not None else None
    if part is None:
        raise VidtrackError(f"{path}: the camera's sensor has no calibration. Export it again.")
    try:
        lens = lens_in(part, sensor)
    except ValueError as error:
        raise VidtrackError(f"{path}: {error}.") from None
    M = _square(path, own.findtext("transform"))
    scale, turn, shift, known = _chunk(path, chunk)
    if not known and said.units is None:
        raise VidtrackError(
            f"{said.where}.units: {path} has no transform of the chunk, so its lengths are in a unit of its own. "
            "Set a scale in "
            "Metashape, or give units: m if they are metres."
        )
    own_turn = rotation(M[:3, :3], path)
    R = own_turn.T @ turn.T
    T = -R @ shift - scale * (own_turn.T @ M[:3, 3])
    findings: tuple[Finding, ...] = ()
    if part.get("class") != "adjusted":
        text = f"{said.name}: the Metashape file has an initial calibration only, none that was adjusted"
        findings = (Finding("doubtful", "lens-not-adjusted", text, "Align or optimise the cameras, and export again."),)
    given = of_lens("metashape", lens, R, T, said, unit="m" if known else None)
    return given._replace(findings=(*given.findings, *findings))


def calibration_of(sensor: ElementTree.Element) -> ElementTree.Element | None:
    """The calibration of a sensor that counts: the adjusted one, else the first."""
    found = list(sensor.iter("calibration"))
    return next((c for c in found if c.get("class") == "adjusted"), found[0] if found else None)


def lens_in(part: ElementTree.Element, sensor: ElementTree.Element | None = None) -> BrownLens:
    """The lens in an element `calibration`, of cameras.xml or of a file of its own.

    sensor  whose resolution counts where the calibration has none
    ValueError, with the cure but without the full stop, where it cannot be read.
    """
    kind = part.get("type") or part.findtext("projection") or "frame"
    if kind not in ("frame", "fisheye", "equidistant_fisheye"):
        raise ValueError(f"a lens of type {kind}, which has no counterpart here; frame and fisheye are read")
    width, height = _resolution(part) or (_resolution(sensor) if sensor is not None else None) or (0, 0)

    def value(name: str) -> float:
        text = part.findtext(name)
        found = number(text) if text is not None else 0.0
        if found is None or not np.isfinite(found):
            raise ValueError(f"{name} {text!r} of the lens is no number. Export it again")
        return found

    f = value("f") or value("fx")
    if not (width and height and f > 0):
        raise ValueError("the lens has no f or no resolution. Export it again")
    if any(value(name) for name in ("p3", "p4")):
        raise ValueError("the lens has p3 or p4, which are not read. Optimise the cameras without them")
    return BrownLens(
        *(f + value("b1"), value("fy") or f, width / 2 - 0.5 + value("cx"), height / 2 - 0.5 + value("cy")),
        image_size=(width, height),
        k=tuple(value(name) for name in ("k1", "k2", "k3", "k4")),
        p1=value("p2"),
        p2=value("p1"),
        skew=value("b2"),
        fisheye=kind != "frame",
    )


def _resolution(element: ElementTree.Element) -> tuple[int, int] | None:
    """(width, height) px: an element `resolution`, or two elements; None where there is neither."""
    own = element.find("resolution")
    names = ("width", "height")
    sides = [number((own.get(name) if own is not None else element.findtext(name)) or "") for name in names]
    if any(side is None or not side > 0 for side in sides):
        return None
    width, height = (int(side or 0) for side in sides)
    return width, height


def _chunk(path: Path, chunk: ElementTree.Element) -> tuple[float, np.ndarray, np.ndarray, bool]:
    own = chunk.find("transform")
    if own is None:
        return 1.0, np.eye(3), np.zeros(3), False
    turn = numbers((own.findtext("rotation") or "").split())
    shift = numbers((own.findtext("translation") or "0 0 0").split())
    scale = number(own.findtext("scale") or "1")
    if not turn or not shift or len(shift) != 3 or not scale:
        return 1.0, np.eye(3), np.zeros(3), False
    return scale, rotation(turn, path), np.array(shift), own.findtext("scale") is not None


def _square(path: Path, text: str | None) -> np.ndarray:
    values = numbers((text or "").split())
    if not values or len(values) != 16 or not np.isfinite(values).all():
        raise VidtrackError(f"{path}: a camera's transform is not 16 numbers. Export it again.")
    return np.array(values).reshape(4, 4)

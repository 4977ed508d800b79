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
    lens, adjusted = _lens(path, sensor)
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
    if not adjusted:
        text = f"{said.name}: the Metashape file has an initial calibration only, none that was adjusted"
        findings = (Finding("doubtful", "lens-not-adjusted", text, "Align or optimise the cameras, and export again."),)
    given = of_lens("metashape", lens, R, T, said, unit="m" if known else None)
    return given._replace(findings=(*given.findings, *findings))


def _lens(path: Path, sensor: ElementTree.Element | None) -> tuple[BrownLens, bool]:
    found = list(sensor.iter("calibration")) if sensor is not None else []
    best = next((c for c in found if c.get("class") == "adjusted"), found[0] if found else None)
    if best is None:
        raise VidtrackError(f"{path}: the camera's sensor has no calibration. Export it again.")
    if best.get("type", "frame") not in ("frame", "fisheye"):
        raise VidtrackError(f"{path}: a lens of type {best.get('type')}; frame and fisheye are read.")
    size = best.find("resolution")
    if size is None and sensor is not None:
        size = sensor.find("resolution")
    width, height = (number(size.get(key, "")) if size is not None else None for key in ("width", "height"))

    def value(name: str, default: float = 0.0) -> float:
        text = best.findtext(name)
        found = number(text) if text is not None else default
        if found is None or not np.isfinite(found):
            raise VidtrackError(f"{path}: {name} {text!r} of the lens is no number. Export it again.")
        return found

    f = value("f") or value("fx")
    if not (width and height and f > 0):
        raise VidtrackError(f"{path}: the lens has no f or no resolution. Export it again.")
    if any(value(name) for name in ("p3", "p4")):
        raise VidtrackError(f"{path}: the lens has p3 or p4, which are not read. Optimise the cameras without them.")
    middle = width / 2 - 0.5, height / 2 - 0.5
    k = tuple(value(name) for name in ("k1", "k2", "k3", "k4"))
    lens = BrownLens(
        *(f + value("b1"), value("fy") or f, middle[0] + value("cx"), middle[1] + value("cy")),
        image_size=(int(width), int(height)),
        k=k,
        p1=value("p2"),
        p2=value("p1"),
        skew=value("b2"),
        fisheye=best.get("type") == "fisheye",
    )
    return lens, best.get("class") == "adjusted"


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

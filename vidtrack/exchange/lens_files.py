"""Lenses from the files of other programs, as coefficients from undistorted to distorted.

| file | origin of px | what is read |
|---|---|---|
| OpenCV YAML, XML, JSON; ROS | centre of the top-left pixel | camera_matrix, distortion_coefficients, size |
| Metashape XML | its corner; cx, cy from the middle of the picture | f, cx, cy, b1, b2, k1 to k4, p1, p2 (exchanged) |
| COLMAP cameras.txt | its corner | every model but FOV and THIN_PRISM_FISHEYE |

Sources: OpenCV's calibration sample; the manuals of Metashape (appendix D) and COLMAP (camera models).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

from vidtrack.exchange.cameras import metashape, opencv
from vidtrack.exchange.text import text_of
from vidtrack.exchange.xml import parsed
from vidtrack.geometry.brown import BrownLens
from vidtrack.naming import some_of

COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 d1 d2 d3",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
}
"""The numbers of COLMAP's camera models, in its order; d1 to d3 are those of the denominator."""

DEVIATIONS = ("std_deviations_intrinsics", "stddeviationsintrinsics", "std_intrinsics", "stddevintrinsics")
OPENCV_ORDER = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
WHICH = "say which, lens: {file: ..., camera: ...}"


def read_lens(path: str, camera: str) -> tuple[BrownLens, dict[str, float]]:
    """The lens in a file, and the standard deviations of its numbers where the file gives them.

    camera  which one, of a file that holds several
    The parsers are those of whole cameras (exchange.cameras), which need a pose; COLMAP's is here. The size of the
    picture is (0, 0) where the file does not say it. Raises VidtrackError where the file cannot be
    read, ValueError, KeyError, TypeError, OverflowError or RecursionError where it holds no lens.
    """
    text = text_of(path)
    if text.lstrip().startswith("<"):
        root = parsed(path)
        if root.tag != "opencv_storage":
            return _from_metashape(root, camera)
    elif path.lower().endswith(".json"):
        return _from_matrix(json.loads(text), camera)
    elif not path.lower().endswith((".yaml", ".yml")) and not text.startswith("%YAML"):
        return _from_colmap(text, camera)
    return _from_matrix(opencv.stored(path), camera)


def _from_matrix(record: Any, camera: str) -> tuple[BrownLens, dict[str, float]]:
    """OpenCV's names, in any case, at the top or under the camera's name."""
    found = opencv.in_small_letters(record)
    if not _has_matrix(found):
        of = {name: own for name, own in found.items() if isinstance(own, Mapping) and _has_matrix(own)}
        if camera.lower() in of or len(of) == 1:
            return _from_matrix(of[camera.lower()] if camera.lower() in of else next(iter(of.values())), camera)
        raise ValueError(f"it holds {some_of(list(of))}: {WHICH}" if of else "no camera_matrix in it")
    lens = opencv.lens_in(found)
    deviations = opencv.numbers_of(next((found[name] for name in DEVIATIONS if name in found), ()))
    sd = dict(zip(OPENCV_ORDER, deviations.tolist(), strict=False)) if not lens.fisheye else {}
    return lens, {name: value for name, value in sd.items() if value > 0}


def _has_matrix(own: Mapping[str, Any]) -> bool:
    return opencv.named(opencv.in_small_letters(own), "matrix") is not None


def _from_metashape(root: ElementTree.Element, camera: str) -> tuple[BrownLens, dict[str, float]]:
    """A camera calibration as Metashape exports it, or a sensor of its cameras.xml."""
    if root.tag == "calibration":
        return metashape.lens_in(root), {}
    sensors = {str(s.get("label") or s.get("id")): s for s in root.iter("sensor")}
    if camera not in sensors and len(sensors) != 1:
        raise ValueError(f"sensors {some_of(list(sensors)) or 'none'}: {WHICH}")
    sensor = sensors[camera] if camera in sensors else next(iter(sensors.values()))
    part = metashape.calibration_of(sensor)
    if part is None:
        raise ValueError("the sensor has no calibration")
    return metashape.lens_in(part, sensor), {}


def _from_colmap(text: str, camera: str) -> tuple[BrownLens, dict[str, float]]:
    rows = [line.split() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    by_id = {row[0]: row for row in rows if len(row) > 4}
    if camera not in by_id and len(by_id) != 1:
        raise ValueError(f"cameras {some_of(list(by_id)) or 'none'}: {WHICH}")
    _, model, width, height, *numbers = by_id.get(camera) or next(iter(by_id.values()))
    if model not in COLMAP:
        raise ValueError(f"COLMAP's model {model}, which has no counterpart here; there are {', '.join(COLMAP)}")
    names = COLMAP[model].split()
    if len(numbers) != len(names):
        raise ValueError(f"{len(numbers)} numbers, where {model} has {len(names)}")
    given = dict(zip(names, (float(each) for each in numbers), strict=True))
    f = given.get("f", 0.0)
    lens = BrownLens(
        given.get("fx", f),
        given.get("fy", f),
        given["cx"] - 0.5,
        given["cy"] - 0.5,
        (int(width), int(height)),
        tuple(given.get(f"k{n}", 0.0) for n in range(1, 5 if "FISHEYE" in model else 4)),
        p1=given.get("p1", 0.0),
        p2=given.get("p2", 0.0),
        denominator=tuple(given[f"d{n}"] for n in (1, 2, 3)) if "d1" in given else (),
        fisheye="FISHEYE" in model,
    )
    return lens, {}

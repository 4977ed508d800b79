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
import re
from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np

from vidtrack.errors import VidtrackError
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

MATRIX = ("camera_matrix", "cameramatrix", "intrinsic_matrix", "intrinsics", "k", "mtx", "m1", "matrix")
DISTORTION = (
    *("distortion_coefficients", "dist_coeffs", "distcoeffs", "dist_coeff", "distortion", "distortions"),
    *("dist", "d", "d1", "coefficients"),
)
DEVIATIONS = ("std_deviations_intrinsics", "stddeviationsintrinsics", "std_intrinsics", "stddevintrinsics")
SIZES = (("image_width", "image_height"), ("width", "height"), ("w", "h"))
OPENCV_ORDER = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
WHICH = "say which, lens: {file: ..., camera: ...}"


def read_lens(path: str, camera: str) -> tuple[BrownLens, dict[str, float]]:
    """The lens in a file, and the standard deviations of its numbers where the file gives them.

    camera  which one, of a file that holds several
    The size of the picture is (0, 0) where the file does not say it. Raises VidtrackError where the file cannot be
    read, ValueError, KeyError, TypeError or OverflowError where it holds no lens.
    """
    try:
        with open(path, encoding="utf-8-sig", errors="strict") as file:
            text = file.read(4_000_000)
    except (OSError, UnicodeDecodeError) as error:
        raise VidtrackError(f"{path}: cannot be read as text ({error}).") from None
    if text.lstrip().startswith("<"):
        return _from_xml(path, text, camera)
    if path.lower().endswith(".json"):
        return _from_matrix(path, json.loads(text), camera)
    if path.lower().endswith((".yaml", ".yml")) or text.startswith("%YAML"):
        return _from_matrix(path, _yaml(text), camera)
    return _from_colmap(path, text, camera)


def _yaml(text: str) -> Any:
    """OpenCV's YAML, whose first line no YAML reader takes, or plain YAML."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Reads OpenCV's matrices as plain mappings."""

    for kind in ("opencv-matrix", "opencv-nd-matrix"):
        Loader.add_constructor(f"tag:yaml.org,2002:{kind}", _mapping)
    text = re.sub(r"\A%YAML[^\n]*\n", "", text)
    try:
        return yaml.load(text, Loader)
    except yaml.YAMLError as error:
        raise ValueError(f"no YAML ({str(error).splitlines()[0]})") from None


def _mapping(loader: Any, node: Any) -> Any:
    return loader.construct_mapping(node, deep=True)


def _lower(record: Any) -> dict[str, Any]:
    if not isinstance(record, Mapping):
        raise ValueError("no camera_matrix in it")
    return {str(key).lower(): value for key, value in record.items()}


def _from_matrix(path: str, record: Any, camera: str) -> tuple[BrownLens, dict[str, float]]:
    """OpenCV's names, in any case, at the top or under the camera's name."""
    found = _lower(record)
    key = next((name for name in MATRIX if name in found), None)
    if key is None:
        inside = {name: value for name, value in found.items() if isinstance(value, Mapping)}
        of = [name for name, value in inside.items() if any(m in _lower(value) for m in MATRIX)]
        if camera.lower() in of or len(of) == 1:
            return _from_matrix(path, inside[camera.lower() if camera.lower() in of else of[0]], camera)
        known = f"it holds {some_of(of)}: {WHICH}" if of else "no camera_matrix in it"
        raise ValueError(known)
    K = _numbers(found[key])
    if K.size != 9:
        raise ValueError(f"{key} has {K.size} numbers, not 3 x 3")
    K = K.reshape(3, 3)
    k = _numbers(next((found[name] for name in DISTORTION if name in found), ()))
    model = str(found.get("distortion_model", found.get("model", ""))).lower()
    fisheye = bool(found.get("fisheye_model") or found.get("fisheye")) or model in ("fisheye", "equidistant")
    size = _size(found)
    lens = BrownLens(float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]), size, skew=float(K[0, 1]))
    if not np.isfinite([*K.ravel(), *k]).all():
        raise ValueError("numbers that are not finite")
    if fisheye:
        lens = lens._replace(k=tuple(k[:4].tolist()), fisheye=True)
    else:
        k = np.concatenate([k, np.zeros(max(0, 12 - k.size))])
        if np.abs(k[12:]).any():
            raise ValueError("a tilted sensor (tau_x, tau_y), which has no counterpart here")
        lens = lens._replace(
            k=(float(k[0]), float(k[1]), float(k[4])),
            p1=float(k[2]),
            p2=float(k[3]),
            denominator=tuple(k[5:8].tolist()) if k[5:8].any() else (),
            prism=(float(k[8]), float(k[9]), float(k[10]), float(k[11])),
        )
    deviations = _numbers(next((found[name] for name in DEVIATIONS if name in found), ()))
    sd = dict(zip(OPENCV_ORDER, deviations.tolist(), strict=False)) if not fisheye else {}
    return lens, {name: value for name, value in sd.items() if value > 0}


def _numbers(value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    if isinstance(value, Mapping):
        value = value.get("data", ())
    if isinstance(value, str):
        value = value.split()
    return np.array([float(each) for each in _flat(value)], float)


def _flat(value: Any) -> list[Any]:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [each for part in value for each in _flat(part)]
    return [value]


def _size(found: Mapping[str, Any]) -> tuple[int, int]:
    """(width, height), or (0, 0) where the file does not say it."""
    for wide, high in SIZES:
        if wide in found and high in found:
            return int(float(found[wide])), int(float(found[high]))
    for name in ("image_size", "imagesize", "size", "resolution", "img_size"):
        if name in found and len(pair := _numbers(found[name])) == 2:
            return int(pair[0]), int(pair[1])
    return 0, 0


def _from_xml(path: str, text: str, camera: str) -> tuple[BrownLens, dict[str, float]]:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("XML with declarations of its own")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"no XML ({error})") from None
    if root.tag == "opencv_storage":
        record = {child.tag: {"data": child.findtext("data")} if len(child) else child.text for child in root}
        return _from_matrix(path, record, camera)
    return _from_metashape(root, camera)


def _from_metashape(root: ElementTree.Element, camera: str) -> tuple[BrownLens, dict[str, float]]:
    """A camera calibration as Metashape exports it, or the sensors of its cameras.xml; adjusted before initial."""
    if root.tag == "calibration":
        return _metashape(root), {}
    sensors = {str(s.get("label") or s.get("id")): s for s in root.iter("sensor")}
    if camera not in sensors and len(sensors) != 1:
        raise ValueError(f"sensors {some_of(list(sensors)) or 'none'}: {WHICH}")
    sensor = sensors.get(camera) or next(iter(sensors.values()))
    found = {part.get("class", ""): part for part in sensor.iter("calibration")}
    chosen = found.get("adjusted", found.get("", found.get("initial")))
    if chosen is None:
        raise ValueError("the sensor has no calibration")
    return _metashape(chosen), {}


def _metashape(part: ElementTree.Element) -> BrownLens:
    kind = part.get("type") or part.findtext("projection") or "frame"
    if kind not in ("frame", "fisheye", "equidistant_fisheye"):
        raise ValueError(f"Metashape's projection {kind}, which has no counterpart here")
    resolution = part.find("resolution")
    size = (resolution.get("width"), resolution.get("height")) if resolution is not None else (None, None)
    width, height = (int(a or part.findtext(b) or 0) for a, b in zip(size, ("width", "height"), strict=True))
    if not (width and height):
        raise ValueError("no size of the picture")

    def number(name: str) -> float:
        return float(part.findtext(name) or 0.0)

    f = number("f") or number("fx")
    return BrownLens(
        f + number("b1"),
        number("fy") or f,
        (width - 1) / 2 + number("cx"),
        (height - 1) / 2 + number("cy"),
        (width, height),
        tuple(number(f"k{n}") for n in range(1, 5)),
        p1=number("p2"),
        p2=number("p1"),
        skew=number("b2"),
        fisheye=kind != "frame",
    )


def _from_colmap(path: str, text: str, camera: str) -> tuple[BrownLens, dict[str, float]]:
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

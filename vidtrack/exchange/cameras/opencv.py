"""OpenCV: a YAML or XML that cv::FileStorage wrote, with a camera's matrix, distortion, picture size and pose.

FileStorage fixes no names: those of OpenCV's own samples and of common tools are known (NAMES below), in small or large
letters. The centre of the first pixel is (0, 0); distortion from undistorted to distorted, k1 k2 p1 p2 [k3 ...];
c = R p + T, right-handed; unit as the user's board. ROS camera_info and OpenCV's intrinsics alone hold no pose and are
refused as a camera; `exchange.lens_files` reads their lens with the parser here.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.anipose import lens_of
from vidtrack.exchange.cameras.given import Given, Said, needed_size, of_lens, rotation
from vidtrack.exchange.text import Path, numbers, text_of
from vidtrack.geometry.brown import BrownLens

NAMES = {
    "matrix": ("camera_matrix", "cameramatrix", "intrinsic_matrix", "intrinsics", "k", "m", "mtx", "m1", "matrix"),
    "distortion": (
        *("distortion_coefficients", "dist_coeffs", "distcoeffs", "dist_coeff", "distortion", "distortions"),
        *("dist", "d", "d1", "coefficients"),
    ),
    "rotation": ("r", "rotation", "rotation_matrix", "rvec", "rvecs", "rotation_vector"),
    "translation": ("t", "translation", "tvec", "tvecs", "translation_vector"),
    "size": ("image_size", "imagesize", "size", "resolution", "img_size"),
    "fisheye": ("fisheye_model", "fisheyemodel", "fisheye"),
    "model": ("distortion_model", "model"),
}
"""What numbers are called, in small letters; the first that a file has is taken."""

OF_A_PAIR = ("m1", "d1")
"""Names of OpenCV's stereo sample, whose R and T lead from one camera to the other and are no pose."""

SIZES = (("image_width", "image_height"), ("width", "height"), ("w", "h"))


def _yaml(text: str) -> Any:
    """YAML with OpenCV's matrices; ValueError where it is none."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Reads OpenCV's matrices as arrays; FileStorage writes no aliases, with which a file may fill the memory."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                raise yaml.YAMLError("aliases, which OpenCV does not write")
            return super().compose_node(parent, index)

    def matrix(loader: Any, node: Any) -> Any:
        own = loader.construct_mapping(node, deep=True)
        return _shaped(own.get("data"), own.get("rows"), own.get("cols"))

    def nd_matrix(loader: Any, node: Any) -> Any:
        own = loader.construct_mapping(node, deep=True)
        return np.asarray(own.get("data"), float).reshape(own.get("sizes"))

    Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", matrix)
    Loader.add_constructor("tag:yaml.org,2002:opencv-nd-matrix", nd_matrix)
    try:
        # FileStorage writes `%YAML:1.0`, which is no YAML directive
        return yaml.load(re.sub(r"^%YAML[^\n]*\n", "", text), Loader=Loader)
    except (yaml.YAMLError, RecursionError, AttributeError, OverflowError) as error:
        raise ValueError(str(error)) from None


def _shaped(data: Any, rows: Any, cols: Any) -> Any:
    values = np.asarray(data, float).ravel()
    if not isinstance(rows, int) or not isinstance(cols, int) or values.size % max(rows * cols, 1):
        raise ValueError(f"a matrix of {rows} x {cols} with {values.size} numbers")
    return values.reshape(rows, cols, -1).squeeze(-1) if values.size == rows * cols else values.reshape(rows, cols, -1)


def stored(path: Path) -> dict[str, Any]:
    """What a file of cv::FileStorage holds, by name; matrices as arrays."""
    text = text_of(path)
    try:
        if text.lstrip().startswith("<"):
            return _from_xml(path)
        own = _yaml(text)
    except (ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:100]
        raise VidtrackError(f"{path}: not a file of OpenCV ({reason}). Copy the whole file again.") from None
    if not isinstance(own, dict):
        raise VidtrackError(f"{path}: not a file of OpenCV: no names in it. Copy the whole file again.")
    return own


def _from_xml(path: Path) -> dict[str, Any]:
    from vidtrack.exchange.xml import parsed

    found: dict[str, Any] = {}
    for element in parsed(path):
        if element.get("type_id") == "opencv-matrix":
            rows, cols = (int(element.findtext(name) or 0) for name in ("rows", "cols"))
            found[element.tag] = _shaped(numbers((element.findtext("data") or "").split()), rows, cols)
        elif len(element):
            found[element.tag] = {child.tag: _scalar(child) for child in element}
        else:
            found[element.tag] = _scalar(element)
    return found


def _scalar(element: ElementTree.Element) -> Any:
    values = numbers((element.text or "").split())
    if not values:
        return (element.text or "").strip()
    return values[0] if len(values) == 1 else values


def lens_in(own: Mapping[str, Any]) -> BrownLens:
    """The lens among named values; no distortion where none is named, the size (0, 0) where it is not stated.

    ValueError where they hold none.
    """
    found = in_small_letters(own)
    key = next((name for name in NAMES["matrix"] if name in found), None)
    if key is None:
        raise ValueError("no camera_matrix in it")
    K = numbers_of(found[key])
    if K.size != 9:
        raise ValueError(f"{key} has {K.size} numbers, not 3 x 3")
    d = numbers_of(named(found, "distortion"))
    if not np.isfinite([*K, *d]).all():
        raise ValueError("numbers that are not finite")
    fisheye = bool(named(found, "fisheye")) or str(named(found, "model")).lower() in ("fisheye", "equidistant")
    return lens_of(K.reshape(3, 3), d, _size(found), fisheye)


def in_small_letters(own: Any) -> dict[str, Any]:
    """Values by their names in small letters; ValueError where they have no names."""
    if not isinstance(own, Mapping):
        raise ValueError("no camera_matrix in it")
    return {str(key).lower(): value for key, value in own.items()}


def named(found: Mapping[str, Any], what: str) -> Any:
    """The value that has one of the names of NAMES; None where none has."""
    return next((found[name] for name in NAMES[what] if name in found), None)


def numbers_of(value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The numbers (n,) of an array, of lists, of text, or of ROS's mapping with `data`; ValueError where others are."""
    if isinstance(value, Mapping):
        value = value.get("data")
    if isinstance(value, str):
        value = value.split()
    try:
        return np.array([float(each) for each in _flat(() if value is None else value)], float)
    except (TypeError, ValueError):
        raise ValueError("text where numbers are expected") from None


def _flat(value: Any) -> list[Any]:
    if isinstance(value, np.ndarray):
        value = value.ravel().tolist()
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [each for part in value for each in _flat(part)]
    return [value]


def _size(found: Mapping[str, Any]) -> tuple[int, int]:
    """(width, height), or (0, 0) where the file does not say it."""
    for wide, high in SIZES:
        if wide in found and high in found:
            sides = numbers_of([found[wide], found[high]])
            return int(sides[0]), int(sides[1])
    for name in NAMES["size"]:
        if name in found and len(pair := numbers_of(found[name])) == 2:
            return int(pair[0]), int(pair[1])
    return 0, 0


def read(path: Path, said: Said) -> Given:
    """The camera in a file of cv::FileStorage."""
    found = {name: value for name, value in in_small_letters(stored(path)).items() if name not in OF_A_PAIR}
    try:
        lens = lens_in(found)
        R, T = (numbers_of(named(found, what)) for what in ("rotation", "translation"))
    except (ValueError, OverflowError) as error:
        raise VidtrackError(f"{path}: {error}. Export it again.") from None
    if named(found, "distortion") is None:
        raise VidtrackError(f"{path}: no distortion_coefficients in it. Write zeros if the lens has none.")
    if R.size == 0 or T.size != 3 or not np.isfinite([*R, *T]).all():
        raise VidtrackError(
            f"{path}: a lens without a pose: no R and T of one view in it. Write them in, or film calibration "
            "points and use it as the camera's lens."
        )
    if 0 in lens.image_size:
        lens = lens._replace(image_size=needed_size(said, "OpenCV"))
    return of_lens("opencv", lens, rotation(R, path), T, said)

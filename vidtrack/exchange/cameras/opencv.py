"""OpenCV: a YAML or XML that cv::FileStorage wrote, with a camera's matrix, distortion, picture size and pose.

FileStorage fixes no names: those of OpenCV's own samples and of common tools are known (NAMES below). The centre of
the first pixel is (0, 0); distortion from undistorted to distorted, k1 k2 p1 p2 [k3 ...]; c = R p + T, right-handed;
unit as the user's board. ROS camera_info and OpenCV's intrinsics alone hold no pose and are refused here.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np
import yaml

from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.anipose import lens_of
from vidtrack.exchange.cameras.given import Given, Said, needed_size, of_lens, rotation
from vidtrack.exchange.text import Path, numbers, text_of

NAMES = {
    "matrix": ("camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsics", "intrinsic_matrix", "K", "M", "mtx"),
    "distortion": ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs", "dist", "D"),
    "rotation": ("R", "rotation", "rotation_matrix", "rvec", "rvecs", "rotation_vector"),
    "translation": ("T", "t", "translation", "tvec", "tvecs", "translation_vector"),
    "width": ("image_width", "image_Width", "width"),
    "height": ("image_height", "image_Height", "height"),
    "size": ("image_size", "imageSize", "size"),
    "fisheye": ("fisheye", "fisheye_model", "fisheyeModel"),
}


class _Loader(yaml.SafeLoader):
    """YAML with OpenCV's matrices."""


def _matrix(loader: yaml.SafeLoader, node: yaml.Node) -> Any:
    own: dict[Any, Any] = loader.construct_mapping(node, deep=True)  # type: ignore[arg-type]
    return _shaped(own.get("data"), own.get("rows"), own.get("cols"))


def _shaped(data: Any, rows: Any, cols: Any) -> Any:
    values = np.asarray(data, float).ravel()
    if not isinstance(rows, int) or not isinstance(cols, int) or values.size % max(rows * cols, 1):
        raise ValueError(f"a matrix of {rows} x {cols} with {values.size} numbers")
    return values.reshape(rows, cols, -1).squeeze(-1) if values.size == rows * cols else values.reshape(rows, cols, -1)


def _nd_matrix(loader: yaml.SafeLoader, node: yaml.Node) -> Any:
    own: dict[Any, Any] = loader.construct_mapping(node, deep=True)  # type: ignore[arg-type]
    return np.asarray(own.get("data"), float).reshape(own.get("sizes"))


_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _matrix)
_Loader.add_constructor("tag:yaml.org,2002:opencv-nd-matrix", _nd_matrix)


def stored(path: Path) -> dict[str, Any]:
    """What a file of cv::FileStorage holds, by name; matrices as arrays."""
    text = text_of(path)
    try:
        if text.lstrip().startswith("<"):
            return _from_xml(path, text)
        # FileStorage writes `%YAML:1.0`, which is no YAML directive
        own = yaml.load(re.sub(r"^%YAML[^\n]*\n", "", text), Loader=_Loader)
    except (yaml.YAMLError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:100]
        raise VidtrackError(f"{path}: not a file of OpenCV ({reason}). Copy the whole file again.") from None
    if not isinstance(own, dict):
        raise VidtrackError(f"{path}: not a file of OpenCV: no names in it. Copy the whole file again.")
    return own


def _from_xml(path: Path, text: str) -> dict[str, Any]:
    from vidtrack.exchange.xml import parsed

    found: dict[str, Any] = {}
    for element in parsed(path):
        if element.get("type_id") == "opencv-matrix":
            rows, cols = (int(element.findtext(name) or 0) for name in ("rows", "cols"))
            found[element.tag] = _shaped(numbers((element.findtext("data") or "").split()), rows, cols)
        else:
            found[element.tag] = _scalar(element)
    return found


def _scalar(element: ElementTree.Element) -> Any:
    values = numbers((element.text or "").split())
    if not values:
        return (element.text or "").strip()
    return values[0] if len(values) == 1 else values


def read(path: Path, said: Said) -> Given:
    """The camera in a file of cv::FileStorage."""
    own = stored(path)
    found = {key: next((own[name] for name in names if name in own), None) for key, names in NAMES.items()}
    if found["matrix"] is None and isinstance(own.get("camera_matrix"), dict):
        found["matrix"] = own["camera_matrix"]
    K, d = _numbers(found["matrix"]), _numbers(found["distortion"])
    if K is None or K.size != 9:
        raise VidtrackError(f"{path}: no camera_matrix of 3 x 3 numbers in it. Export it again.")
    if d is None:
        raise VidtrackError(f"{path}: no distortion_coefficients in it. Write zeros if the lens has none.")
    R, T = _numbers(found["rotation"]), _numbers(found["translation"])
    if R is None or T is None or T.size != 3:
        raise VidtrackError(
            f"{path}: a lens without a pose: no R and T of one view in it. Write them in, or film calibration "
            "points and use it "
            "as the camera's lens."
        )
    size = found["size"] if found["size"] is not None else (found["width"], found["height"])
    sized = _numbers(size)
    shape = (int(sized[0]), int(sized[1])) if sized is not None and sized.size == 2 else needed_size(said, "OpenCV")
    lens = lens_of(K.reshape(3, 3), d, shape, bool(found["fisheye"]))
    return of_lens("opencv", lens, rotation(R, path), T.ravel(), said)


def _numbers(value: Any) -> np.ndarray[Any, Any] | None:
    """Numbers, from an array, a list, or ROS's mapping with `data`."""
    if isinstance(value, dict):
        value = value.get("data")
    try:
        values = np.asarray(value, float)
    except (TypeError, ValueError):
        return None
    return values if value is not None and np.isfinite(values).all() else None

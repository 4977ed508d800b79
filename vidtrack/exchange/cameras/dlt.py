"""DLT coefficients (DLTdv, Argus, easyWand, Kwon): 11 numbers a camera, a column each, no header.

    u = (L1 x + L2 y + L3 z + L4) / (L9 x + L10 y + L11 z + 1),   v = (L5 x + L6 y + L7 z + L8) / (the same)

u, v are pixels of the program that made them: DLTdv 8 counts from the upper-left corner, 5 to 7 from the lower-left
one, both from 1; Argus from the lower-left, u from 0, v = height - row. Nothing in the file says which, nor how
large the picture is: `camera_file.format` (or origin and first_pixel) and `camera_file.size` do. World axes are
right-handed; with the wrong corner the camera is a mirror, and then the world's origin comes to lie behind it, which
is reported. The eleven numbers are a camera with skew and no lens; with an Argus profile (`camera_file.lens`) they
belong to pixels without distortion. A lower number than 8 digits costs accuracy: DLTdv writes five.
"""

from __future__ import annotations

import re

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.dlt import decomposed
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.argus import Profile, read_profiles
from vidtrack.exchange.cameras.fitting import fitted
from vidtrack.exchange.cameras.given import Given, Said, lens_findings, needed_size
from vidtrack.exchange.text import Path, lines_of, numbers
from vidtrack.findings import Finding
from vidtrack.geometry.brown import distorted
from vidtrack.geometry.camera import Camera

CONVENTIONS = {
    "dltdv8": ("upper-left", (1.0, 1.0)),
    "dltdv": ("lower-left", (1.0, 1.0)),
    "argus": ("lower-left", (0.0, 1.0)),
}
"""Of `camera_file.format`: the corner and the coordinates of the centre of its pixel; dltdv: DLTdv 5 to 7, and "
"easyWand."""


def read_coefficients(path: Path) -> Array:
    """The coefficients, (11, cameras)."""
    rows = []
    for i, line in enumerate(lines_of(path)):
        if not line.strip():
            continue
        found = numbers(_cells(line.strip(" ,;\t")))
        if found is None or not np.isfinite(found).all():
            raise VidtrackError(f"{path}, line {i + 1}: {line.strip()[:40]!r} are no coefficients. Export them again.")
        rows.append(found)
    if len({len(row) for row in rows}) != 1:
        raise VidtrackError(f"{path}: rows of different lengths. Copy the whole file again.")
    table = np.array(rows)
    if table.shape[0] != 11 and table.shape[1] == 11:
        table = table.T
    if table.shape[0] != 11:
        raise VidtrackError(
            f"{path}: {table.shape[0]} x {table.shape[1]} numbers; a camera has 11 coefficients, in a column."
        )
    if (table == np.round(table)).all():
        raise VidtrackError(
            f"{path}: whole numbers alone are no coefficients. Write decimals with a point, or separate cells by "
            "semicolons."
        )
    return table


def _cells(line: str) -> list[str]:
    """The cells of a line: between semicolons, tabs or spaces, where commas begin decimals, else between commas."""
    if ";" in line or "\t" in line:
        return [cell.strip() for cell in re.split(r"[;\t]", line)]
    return re.split(r"[,\s]+", line)


def matrix_of(L: Array) -> Array:
    """The matrix (3, 4) of eleven coefficients."""
    return np.asarray(np.append(np.asarray(L, float), 1.0).reshape(3, 4))


def coefficients_of(P: Array) -> Array:
    """The eleven coefficients of a matrix (3, 4). The world's origin must not lie in the camera's focal plane."""
    return np.asarray((P / P[2, 3]).ravel()[:11])


def frame_buffer(origin: str, first: tuple[float, float], size: tuple[int, int]) -> Array:
    """The matrix (3, 3) that takes a program's pixels (u, v, 1) to the frame buffer's."""
    if origin == "lower-left":
        return np.array([[1, 0, -first[0]], [0, -1, size[1] - 1 + first[1]], [0, 0, 1]])
    return np.array([[1, 0, -first[0]], [0, 1, -first[1]], [0, 0, 1]])


def read(path: Path, said: Said) -> Given:
    """The camera in a column of coefficients."""
    table = read_coefficients(path)
    L = table[:, _column(table.shape[1], said, path)]
    size = needed_size(said, "DLT")
    origin, first = CONVENTIONS.get(said.format or "", (None, None))
    origin, first = said.origin or origin, said.first or first
    if origin is None or first is None:
        missing = "origin" if origin is None else "first_pixel"
        raise VidtrackError(
            f"{said.where}.{missing}: DLT coefficients do not say how their pixels are counted. Give format: "
            "dltdv8, dltdv (5 "
            "to 7, easyWand) or argus, or give origin and first_pixel."
        )
    A = frame_buffer(origin, first, size)
    P = A @ matrix_of(L)
    length = np.linalg.norm(P[2, :3])
    if not length > 0:
        raise VidtrackError(f"{path}: L9, L10 and L11 are 0: no camera at a finite distance. Calibrate again.")
    P = P / length * np.sign(np.linalg.det(P[:, :3]))
    K, R, T, handed = decomposed(P)
    if handed < 0 or not np.isfinite(K).all():
        raise VidtrackError(f"{path}: these coefficients are no camera: their matrix has no inverse. Calibrate again.")
    f = K[1, 1]
    camera = Camera(
        *(float(K[0, 2]), float(K[1, 2]), 1.0, 1.0, float(K[0, 0] / f), float(f), 0.0),
        R=R,
        T=T,
        image_size=size,
        skew=float(K[0, 1] / f),
        name=said.name,
    )
    findings: tuple[Finding, ...] = ()
    if P[2, 3] <= 0:
        text = f"{said.name}: by its DLT coefficients the world's origin lies behind the camera"
        cure = (
            "If it is in view, pixels are counted from the other corner (camera_file.origin), or axes are left-handed."
        )
        findings = (Finding("doubtful", "dlt-origin-behind", text, cure),)
    largest = 0.0
    if said.lens:
        camera, largest = _with_lens(camera, read_profiles(said.lens), said, A)
        findings += lens_findings("Argus", said.name, largest)
    return Given("dlt", camera, largest, findings=findings)


def _column(n: int, said: Said, path: Path) -> int:
    if n == 1 and said.camera is None:
        return 0
    digits = re.sub(r"\D", "", said.camera or "")
    if digits and 1 <= int(digits) <= n:
        return int(digits) - 1
    raise VidtrackError(
        f"{said.where}.camera: {path} has {n} columns of coefficients. Say which of them is {said.name}'s, as in "
        "camera: 1."
    )


def _with_lens(camera: Camera, profiles: list[Profile], said: Said, A: Array) -> tuple[Camera, float]:
    """The camera with an Argus profile's distortion before its coefficients' pixels; A: these to the frame buffer."""
    digits = re.sub(r"\D", "", said.camera or "")
    number = int(digits) if digits else 1
    profile = profiles[0] if len(profiles) == 1 else next((p for p in profiles if p.number == number), None)
    if profile is None:
        raise VidtrackError(
            f"{said.where}.lens: no line of camera {number} in {said.lens}. Correct the file, or give camera."
        )
    lens = profile.lens

    def seen(x: Array) -> Array:
        ideal = np.stack([camera.f * (camera.Sx * x[:, 0] + camera.skew * x[:, 1]), camera.f * x[:, 1]], -1)
        ideal += [camera.Cx, camera.Cy]
        return distorted(lens, (ideal - [lens.cx, lens.cy]) / [lens.fx, lens.fy])

    return fitted(camera, seen)

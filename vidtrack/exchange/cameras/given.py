"""A camera as another program gives it, and what the user says of its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from vidtrack.arrays import Array
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.geometry.brown import BrownLens
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_conversion import camera_from_brown
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.lengths import METRES

COVERED = 0.995
"""Share of the picture below which it is said that a lens folds in it; rounding at the edges costs less."""


@dataclass(frozen=True)
class Said:
    """What the config says of a camera's file; None where it says nothing.

    name    of the camera in vidtrack; camera: in the file
    origin, first, size   as of tracks (`tracks.digitised`), for formats in px whose file does not say it
    sensor  mm (width, height); Cx, Cy px: for formats whose file lacks them
    units   of the file's lengths, where the file does not say it; world: the unit of the experiment
    lens    path of an Argus camera profile that belongs to DLT coefficients
    """

    name: str
    world: str
    format: str | None = None
    camera: str | None = None
    origin: Literal["upper-left", "lower-left"] | None = None
    first: tuple[float, float] | None = None
    size: tuple[int, int] | None = None
    sensor: tuple[float, float] | None = None
    Cx: float | None = None
    Cy: float | None = None
    units: str | None = None
    lens: str | None = None

    @classmethod
    def of(cls, order: Mapping[str, Any]) -> Said:
        """What the order of job import_camera says."""

        def pair(key: str) -> Any:
            return None if order.get(key) is None else tuple(order[key])

        return cls(
            name=order["camera"],
            world=order["units"],
            format=order.get("format"),
            camera=order.get("camera_in_file"),
            origin=order.get("origin"),
            first=pair("first_pixel"),
            size=pair("size"),
            sensor=pair("sensor"),
            Cx=order.get("Cx"),
            Cy=order.get("Cy"),
            units=order.get("unit_of_file"),
            lens=order.get("lens"),
        )

    @property
    def where(self) -> str:
        """The place in config.yaml, for messages."""
        return f"config.yaml: cameras.{self.name}.camera_file"


class Given(NamedTuple):
    """A camera of a file.

    largest_px  by how much vidtrack's lens differs from the file's, at most, in the picture
    unit        of the file's lengths; None: as the config says, or the experiment's
    """

    format: str
    camera: Camera
    largest_px: float
    unit: str | None = None
    findings: tuple[Finding, ...] = ()


def of_lens(format: str, lens: BrownLens, R: Array, T: Array, said: Said, unit: str | None = None) -> Given:
    """A camera from its lens and pose; VidtrackError where either cannot be one."""
    try:
        done = camera_from_brown(lens, R=R, T=T, name=said.name)
    except ValueError as error:
        raise VidtrackError(
            f"camera {said.name}: its {format} file holds no camera ({error}). Export it again."
        ) from None
    findings = lens_findings(format, said.name, done.largest_px, done.covered)
    return Given(format, done.camera, done.largest_px, unit, findings)


def lens_findings(format: str, name: str, largest_px: float, covered: float = 1.0) -> tuple[Finding, ...]:
    """What is to be said where a lens is not met exactly, or folds within the picture.

    covered   the share of the picture in which the lens of the file has a line of sight
    """
    found: list[Finding] = []
    cure = "Calibrate with points or boards, or keep to the middle of the picture."
    if largest_px >= 0.1:
        text = f"{name}: vidtrack's lens differs from the {format} file's by up to {largest_px:.2g} px in the picture"
        found.append(Finding("doubtful", "lens-converted", text, cure))
    if covered < COVERED:
        text = f"{name}: the {format} file's lens has no line of sight in {100 * (1 - covered):.0f} % of the picture"
        found.append(Finding("doubtful", "lens-folds", text, cure))
    return tuple(found)


def rotation(values: object, path: object) -> Array:
    """A rotation (3, 3) from a matrix or Rodrigues' vector; VidtrackError where it is none."""
    R = np.asarray(values, float)
    if R.size == 3:
        return rotation_from_vector(R.ravel())
    if R.size != 9 or not np.isfinite(R).all():
        raise VidtrackError(f"{path}: a rotation of {R.size} numbers, not 9 or 3. Export it again.")
    R = R.reshape(3, 3)
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-3) or np.linalg.det(R) < 0:
        raise VidtrackError(f"{path}: its rotation is none: not square to itself, or mirrored. Export it again.")
    U, _, V = np.linalg.svd(R)  # files round to a few digits
    return np.asarray(U @ V)


def in_world(given: Given, said: Said) -> Camera:
    """The camera with its lengths in the experiment's unit."""
    unit = given.unit or said.units or said.world
    if unit == said.world:
        return given.camera
    return given.camera.with_(T=given.camera.T * (METRES[unit] / METRES[said.world]))


def stated_uncertainty(given: Given, said: Said, sigma_px: float | None) -> tuple[Uncertainty, tuple[Finding, ...]]:
    """What is known of the camera's errors, as an error of its principal point, and all findings of the file.

    sigma_px  px, as the config says; None: no file says it, and the sigma of positions stays unknown
    """
    variance = np.nan if sigma_px is None else float(sigma_px) ** 2
    known = Uncertainty(("Cx", "Cy"), np.zeros(3), np.diag([variance, variance]))
    if sigma_px is not None:
        return known, given.findings
    text = f"{said.name}: the {given.format} file does not say how well the camera is known: sigma of positions is NaN"
    cure = f"Give cameras.{said.name}.camera_file.sigma_px: px, as the calibration's own residuals show it."
    return known, (*given.findings, Finding("doubtful", "camera-sigma-unknown", text, cure))


def needed_size(said: Said, format: str) -> tuple[int, int]:
    """The size of the picture, which the file does not state."""
    if said.size is None:
        raise VidtrackError(
            f"{said.where}.size: a {format} file does not state the size of the picture. Give size: [width, "
            "height] in px."
        )
    return said.size


def chosen(names: list[str], said: Said, path: object) -> int:
    """Which of a file's cameras is meant: the one that the config names, else the one of the same name, else "
    "the only one."""
    wanted = said.camera if said.camera is not None else said.name
    if wanted in names:
        return names.index(wanted)
    if said.camera is None and len(names) == 1:
        return 0
    shown = ", ".join(names[:8]) + (" ..." if len(names) > 8 else "")
    raise VidtrackError(f"{said.where}.camera: {path} has cameras {shown}. Say which of them {said.name} is.")

"""Cameras and calibration points of a rig that is planned or imagined: the thesis's own (chapter 6), and any other.

World axes of the thesis, in inches: x along the rod, y across it, z up; right-handed. The origin is the
middle of the target's path.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.geometry.camera import Camera

THESIS_DISTANCE = 160.0
"""in, camera to target. The lens's widest 44 degrees (thesis 2.2) then cover the 128 in of section 6.8."""

THESIS_SPACING = (18.0, 4.0, 6.0)
"""in, of the calibration balls along x, y and z. See `thesis_points`."""


def look_at(position: ArrayLike, target: ArrayLike, *, roll_deg: float = 0.0, up: ArrayLike = (0, 0, 1)) -> Array:
    """The rotation R (3, 3) of a camera at `position` whose optical axis passes through `target`.

    Rows of R are the camera's axes in the world: x right, y down, z forward. Without roll the x axis is level
    (at right angles to `up`); roll_deg turns the camera clockwise as seen from behind it.
    T follows as -R position. A camera that looks straight along `up` has no level: give another `up`.
    Raises ValueError when position and target coincide or the line between them is parallel to `up`.
    """
    z = np.asarray(target, float) - np.asarray(position, float)
    if not np.linalg.norm(z) > 0:
        raise ValueError("a camera cannot look at its own position")
    z = z / np.linalg.norm(z)
    x = np.cross(z, np.asarray(up, float))
    if np.linalg.norm(x) < 1e-9 * np.linalg.norm(np.asarray(up, float)):
        raise ValueError("the camera looks along `up`, which leaves its roll open: give another `up`")
    x = x / np.linalg.norm(x)
    y = np.cross(z, x)
    roll = np.radians(roll_deg)
    return np.stack([np.cos(roll) * x + np.sin(roll) * y, np.cos(roll) * y - np.sin(roll) * x, z])


def position_from_angles(target: ArrayLike, *, pan_deg: float, tilt_deg: float, distance: float) -> Array:
    """Where a camera stands, (3,), that looks at `target` panned and tilted by these angles from this distance.

    Its optical axis points along (cos pan cos tilt, sin pan cos tilt, -sin tilt): pan turns from +x
    toward +y, tilt downward. At 0, 0 the camera stands at -x and looks along +x.
    """
    pan, tilt = np.radians(pan_deg), np.radians(tilt_deg)
    forward = np.array([np.cos(pan) * np.cos(tilt), np.sin(pan) * np.cos(tilt), -np.sin(tilt)])
    return np.asarray(target, float) - distance * forward


def focal_length_from_field(*, width: float, distance: float, sensor_width: float) -> float:
    """f, unit of sensor_width, of a lens whose picture covers `width` at `distance` (one unit for both)."""
    return sensor_width * distance / width


def thesis_rig(n_cameras: int = 2) -> list[Camera]:
    """The thesis's cameras: 512x480, sensor 8.8 x 6.6 mm, about 128 in wide at the target, no two alike.

    cam1 and cam2 stand on either side of the rod, at the same end, panned 45 degrees to it and tilted 45
    degrees down (6.2), so that their axes meet at 60 degrees; cam3 and cam4 stand likewise at the other end.
    Sx is not 1, the optical axis is 5 to 15 px off the middle, kappa1 moves the corners by 5 to 8 px
    (barrel), and no camera is quite level or aimed quite at the origin, as in a laboratory.
    One px of noise in each coordinate of every camera's centroids gives a mean 3-D error of 0.37 in (2 cameras).
    """
    rows = [
        # pan, tilt, roll, target, Sx, f, kappa1, Cx, Cy
        (-45.0, 45.0, 0.6, (0.8, 0.3, -0.5), 1.020, 10.95, 8.0e-4, 264.6, 231.8),
        (45.0, 44.0, -0.9, (-0.6, 0.5, 0.4), 1.015, 10.92, 6.0e-4, 246.3, 249.7),
        (-134.0, 45.5, 0.4, (0.2, -0.7, 0.3), 1.018, 10.98, 7.0e-4, 262.1, 246.2),
        (136.0, 45.0, -0.5, (-0.4, 0.2, -0.6), 1.012, 10.90, 5.0e-4, 249.4, 228.9),
    ]
    if not 1 <= n_cameras <= len(rows):
        raise ValueError(f"the thesis rig has 1 to {len(rows)} cameras here, not {n_cameras}")
    cameras = []
    for i, (pan, tilt, roll, target, Sx, f, kappa1, Cx, Cy) in enumerate(rows[:n_cameras]):
        position = position_from_angles(target, pan_deg=pan, tilt_deg=tilt, distance=THESIS_DISTANCE)
        R = look_at(position, target, roll_deg=roll)
        cameras.append(
            Camera(Cx, Cy, 8.8 / 512, 6.6 / 480, Sx, f, kappa1, R, -R @ position, (512, 480), name=f"cam{i + 1}")
        )
    return cameras


def thesis_points() -> tuple[list[str], Array]:
    """Tags ("1" to "64") and places (64, 3), in, of the thesis's calibration balls, as they ought to hang.

    Four rows along the rod, each of four wires with four balls, 16 tags a row: row 1 holds tags 1 to 16 at the
    lowest y. Within a row the wires follow along x, and on a wire the balls from the top down.
    The balls hang 6 in apart (6.3). The target moves midway: 3 in from the balls above and below and 2 in from
    the rows beside it (6.8), so the rows are 4 in apart.
    ASSUME: 18 in between wires, which figure 6.3 would show: the balls then surround the 24 in to either side
    that the pluck test moves.
    """
    return points_on_wires(rows=4, wires=4, balls=4, spacing=THESIS_SPACING)


def points_on_wires(
    *, rows: int, wires: int, balls: int, spacing: ArrayLike, centre: ArrayLike = (0, 0, 0)
) -> tuple[list[str], Array]:
    """Tags and places (n, 3) of balls on plumb wires: rows along y, wires along x, balls from the top down z.

    spacing (3,) and centre (3,) in world units; n = rows * wires * balls, tagged from "1" row by row.
    """
    step = np.asarray(spacing, float)
    y, x, z = np.meshgrid(_centred(rows), _centred(wires), -_centred(balls), indexing="ij")
    places = np.stack([x, y, z], -1).reshape(-1, 3) * step + np.asarray(centre, float)
    return [str(i + 1) for i in range(len(places))], places


def _centred(n: int) -> Array:
    return np.arange(n, dtype=float) - (n - 1) / 2

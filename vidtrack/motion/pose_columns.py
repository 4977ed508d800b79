"""Poses of a body over time as columns of a table: bodies.parquet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vidtrack.arrays import Array
from vidtrack.motion.rigid import angles_by_turn, quaternion, roll_pitch_yaw, unwrapped

COLUMNS = {
    "time_s": "s",
    "timecode": "",
    "body": "",
    **dict.fromkeys(("x", "y", "z"), "world"),
    **dict.fromkeys(("roll", "pitch", "yaw"), "deg"),
    **dict.fromkeys(("qw", "qx", "qy", "qz"), ""),
    "rms": "world",
    **dict.fromkeys(("sigma_x", "sigma_y", "sigma_z"), "world"),
    **dict.fromkeys(("sigma_roll", "sigma_pitch", "sigma_yaw"), "deg"),
    "covariance": "",
    "n_targets": "",
    "flag": "",
}

NEAR_VERTICAL_DEG = 85.0
"""Beyond this pitch, roll and yaw turn about nearly the same axis and are flagged."""


def pose_columns(
    name: str,
    times: Array,
    timecode: Any,
    origin: Array,
    R: Array,
    covariance: Array,
    rms: Array,
    n_targets: ArrayLike,
    flag: Sequence[str],
) -> dict[str, Any]:
    """COLUMNS of one body at T times.

    origin, R, covariance   (T, 3), (T, 3, 3), (T, 6, 6) as in `motion.rigid.Pose`; NaN where there is no pose
    timecode                (T,) words, or one for all
    flag                    (T,) what else is to be said; `vertical` is added
    covariance: (36,) row by row, of small turns about the world axes (rad) and of the origin (world units).
    roll, pitch, yaw: degrees, intrinsic z-y'-x'' (yaw, then pitch, then roll), unwrapped over time.
    """
    angles = roll_pitch_yaw(R)
    B = angles_by_turn(angles)
    with np.errstate(invalid="ignore"):
        turn_sd = np.degrees(np.sqrt(np.diagonal(B @ covariance[:, :3, :3] @ np.swapaxes(B, -1, -2), axis1=1, axis2=2)))
        shift_sd = np.sqrt(np.diagonal(covariance[:, 3:, 3:], axis1=1, axis2=2))
    degrees, q = np.degrees(unwrapped(angles)), quaternion(R)
    vertical = np.abs(np.degrees(angles[:, 1])) > NEAR_VERTICAL_DEG
    columns: dict[str, Any] = {"time_s": times, "timecode": timecode}
    columns |= {"body": name} | {a: origin[:, i] for i, a in enumerate("xyz")}
    columns |= {a: degrees[:, i] for i, a in enumerate(("roll", "pitch", "yaw"))}
    columns |= {f"q{a}": q[:, i] for i, a in enumerate("wxyz")} | {"rms": rms}
    columns |= {f"sigma_{a}": shift_sd[:, i] for i, a in enumerate("xyz")}
    columns |= {f"sigma_{a}": turn_sd[:, i] for i, a in enumerate(("roll", "pitch", "yaw"))}
    columns |= {"covariance": list(covariance.reshape(-1, 36)), "n_targets": n_targets}
    columns["flag"] = [
        ";".join(filter(None, (word, "vertical" * bool(v)))) for word, v in zip(flag, vertical, strict=True)
    ]
    return {column: columns[column] for column in COLUMNS}

"""Stage kinematics: trajectories become smoothed positions, velocities and accelerations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from vidtrack.motion.kinematics import motion
from vidtrack.motion.spline_basis import forget

_AXES = ("x", "y", "z")
COLUMNS = {
    "time_s": "s",
    "target": "",
    **dict.fromkeys(_AXES, "world"),
    **dict.fromkeys(("vx", "vy", "vz"), "world/s"),
    **dict.fromkeys(("ax", "ay", "az"), "world/s^2"),
    **dict.fromkeys(("sigma_x", "sigma_y", "sigma_z"), "world"),
    **dict.fromkeys(("sigma_vx", "sigma_vy", "sigma_vz"), "world/s"),
    **dict.fromkeys(("sigma_ax", "sigma_ay", "sigma_az"), "world/s^2"),
    "flag": "",
}


def kinematics(trajectories: pd.DataFrame) -> tuple[pd.DataFrame, list[dict[str, Any]]]:
    """Smoothed motion of every target, and for each target and axis what the smoothing found.

    trajectories   time_s, target, x, y, z[, sigma_x, sigma_y, sigma_z, flag]; world units. sigma is taken as relative:
                   the record shows the rest
    Where a sample is missing its row is NaN; a record is not bridged over gaps of more than two samples. flag
    adds to the trajectory's own: edge (an end of the record, of a gap or beside an impact: acceleration at least twice
    as uncertain as the median), outlier (contradicted by its neighbours, not used), short (too few samples
    between gaps).
    """
    forget()
    tables, smoothing = [], []
    for target, rows in trajectories.groupby("target", sort=True):
        rows = rows.sort_values("time_s").drop_duplicates("time_s")
        table, about = _one(rows, str(target))
        tables.append(table)
        smoothing += about
    if not tables:
        return pd.DataFrame({name: pd.Series(dtype=float) for name in COLUMNS}), []
    return pd.concat(tables, ignore_index=True), smoothing


def _one(rows: pd.DataFrame, target: str) -> tuple[pd.DataFrame, list[dict[str, Any]]]:
    t, p = rows["time_s"].to_numpy(float), rows[list(_AXES)].to_numpy(float)
    flag = rows["flag"].fillna("").astype(str).to_numpy(object) if "flag" in rows else np.full(len(rows), "", object)
    given = rows[[f"sigma_{a}" for a in _AXES]].to_numpy(float) if "sigma_x" in rows else None
    m = motion(t, p, given)
    position, velocity, acceleration, sigma = m.position, m.velocity, m.acceleration, m.sigma
    for name, where in (("edge", m.edge), ("outlier", m.outlier), ("short", m.short)):
        flag = np.where(where, np.where(flag == "", name, flag + ";" + name), flag)
    smoothing = [
        {"target": target, "axis": a, "noise_sd": sd, "noise_ratio": ratio, "spacing_s": spacing}
        for a, sd, ratio, spacing in zip(_AXES, m.noise_sd, m.noise_ratio, m.spacing_s, strict=True)
        if np.isfinite(sd)
    ]
    columns: dict[str, Any] = {"time_s": t, "target": target}
    for k, a in enumerate(_AXES):
        columns |= {a: position[:, k], f"v{a}": velocity[:, k], f"a{a}": acceleration[:, k]}
        columns |= {f"sigma_{d}{a}": sigma[:, k, i] for i, d in enumerate(("", "v", "a"))}
    columns["flag"] = flag
    return pd.DataFrame(columns, index=range(len(t)))[list(COLUMNS)], smoothing

"""Stage kinematics: trajectories become smoothed positions, velocities and accelerations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from vidtrack.findings import Finding
from vidtrack.memory import columns_of
from vidtrack.motion.jumps import Jump, jumps
from vidtrack.motion.kinematics import motion
from vidtrack.motion.spline_basis import forget
from vidtrack.naming import some_of
from vidtrack.timing.clock_text import readable

_AXES = ("x", "y", "z")
USED = ("time_s", "target", *_AXES, "sigma_x", "sigma_y", "sigma_z", "flag")
"""The columns of trajectories that are used."""
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
    columns = columns_of(trajectories, USED)
    which, targets = pd.factorize(columns["target"], sort=True)
    parts, smoothing = [], []
    for k, target in enumerate(targets):
        rows = np.flatnonzero(which == k)
        rows = rows[np.unique(columns["time_s"][rows], return_index=True)[1]]
        part, about = _one({name: column[rows] for name, column in columns.items()}, str(target))
        parts.append(part)
        smoothing += about
    if not parts:
        return pd.DataFrame({name: pd.Series(dtype=float) for name in COLUMNS}), []
    joined = {name: np.concatenate([part.pop(name) for part in parts]) for name in COLUMNS}
    return pd.DataFrame(joined, copy=False), smoothing


def _one(own: dict[str, NDArray[Any]], target: str) -> tuple[dict[str, NDArray[Any]], list[dict[str, Any]]]:
    t, p = own["time_s"].astype(float), np.column_stack([own[a] for a in _AXES]).astype(float)
    flag = np.where(pd.isna(own["flag"]), "", own["flag"]) if "flag" in own else np.full(len(t), "", object)
    given = np.column_stack([own[f"sigma_{a}"] for a in _AXES]).astype(float) if "sigma_x" in own else None
    m = motion(t, p, given)
    for name, where in (("edge", m.edge), ("outlier", m.outlier), ("short", m.short)):
        flag[where] = [f"{word};{name}" if word else name for word in flag[where]]
    smoothing = [
        {"target": target, "axis": a, "noise_sd": sd, "noise_ratio": ratio, "spacing_s": spacing}
        for a, sd, ratio, spacing in zip(_AXES, m.noise_sd, m.noise_ratio, m.spacing_s, strict=True)
        if np.isfinite(sd)
    ]
    columns: dict[str, Any] = {"time_s": t, "target": np.full(len(t), target, object), "flag": flag}
    for k, a in enumerate(_AXES):
        columns |= {a: m.position[:, k], f"v{a}": m.velocity[:, k], f"a{a}": m.acceleration[:, k]}
        columns |= {f"sigma_{d}{a}": m.sigma[:, k, i] for i, d in enumerate(("", "v", "a"))}
    return columns, smoothing


def jump_findings(trajectories: pd.DataFrame, units: str) -> list[Finding]:
    """Where targets that move are elsewhere from one sample to the next; trajectories as `kinematics` takes them."""
    if not set(USED) <= set(trajectories):
        return []
    found: dict[str, list[Jump]] = {}
    for target, rows in trajectories.sort_values("time_s").groupby("target", sort=True):
        plain = (rows["flag"].fillna("") == "").to_numpy()[:, None]
        p, sigma = (rows[[f"{of}{a}" for a in _AXES]].to_numpy(float) for of in ("", "sigma_"))
        flat = np.isnan(p[:, 2]).all()  # mode plane has no z
        p, sigma = (own[:, :2] if flat else own for own in (p, sigma))
        if own := jumps(rows["time_s"].to_numpy(float), np.where(plain, p, np.nan), sigma):
            found[str(target)] = own
    if not found:
        return []
    moments = sorted({jump.time_s for own in found.values() for jump in own})
    longest = max((jump for own in found.values() for jump in own), key=lambda jump: jump.length)
    text = (
        f"{some_of(list(found))} {'jumps' if len(found) == 1 else 'jump'} from one sample to the next at "
        f"{some_of([readable(moment, 2) for moment in moments], 3)}, by up to {longest.length:.3g} {units} where "
        f"{longest.usual:.2g} {units} are the longest step beside it"
    )
    cure = (
        "Was a part of the recordings cut out there, in all cameras alike? Then times after it are too early by what "
        "is missing: take the recordings as the cameras wrote them, or make each part a run of its own. If not, see in "
        "the film whether another thing is followed from there on."
    )
    return [Finding("doubtful", "positions-jump", text, cure)]

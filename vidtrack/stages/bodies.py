"""Stage bodies: the trajectories of targets on a rigid body become its six degrees of freedom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding, Level
from vidtrack.motion.pose_columns import COLUMNS, pose_columns
from vidtrack.motion.rigid import fit_pose

MISFIT = 9.0
"""Reduced chi squared beyond which the targets are not where a rigid body has them (3 sd, rms)."""

SELDOM = 0.05
"""Share of a body's samples below which a flag stays a flag and makes no finding."""

Bodies = Mapping[str, Mapping[str, Sequence[float]]]


def bodies(trajectories: pd.DataFrame, bodies: Bodies, *, where: str = "bodies") -> pd.DataFrame:
    """Position of each body's origin and its attitude, a row for each body and sample time.

    trajectories   time_s, target, x, y, z[, sigma_x, sigma_y, sigma_z, timecode]; world units
    bodies         body: {target: its place in the body's axes}; the body's origin is the point that is reported,
                   so measure from the centre of gravity to have its motion
    covariance: (36,) row by row, of small turns about the world axes (rad) and of the origin (world units).
    roll, pitch, yaw: degrees, intrinsic z-y'-x'' (yaw, then pitch, then roll), unwrapped over time.
    flag: missing (fewer than three targets), collinear, misfit (not where a rigid body has them: a target slipped
    or two were swapped), vertical (pitch beyond 85 degrees: trust the quaternion). A flagged first two are NaN.
    Raises VidtrackError for a body with a target that the run does not have, or too few of them.
    """
    known = sorted(trajectories["target"].astype(str).unique())
    tables = []
    for name, targets in bodies.items():
        strange = [t for t in map(str, targets) if t not in known]
        if strange:
            raise VidtrackError(
                f"{where}.{name}: the run has no target {', '.join(strange)}; it has {', '.join(known)}. "
                "Name the body's targets as targets.csv does."
            )
        tables.append(_one(trajectories, name, {str(t): place for t, place in targets.items()}, where))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame({name: [] for name in COLUMNS})


def account(table: pd.DataFrame) -> tuple[dict[str, Any], list[Finding]]:
    """How each body was located: its samples, those with a pose, the share of each flag, rms; and what to look at.

    table   as `bodies` answers it
    """
    record, findings = {}, []
    for name, rows in table.groupby("body", sort=False):
        flags = rows["flag"].str.split(";").explode()
        shares = {flag: float((flags == flag).sum() / len(rows)) for flag in flags.unique() if flag}
        rms = rows["rms"].mean()
        record[str(name)] = {
            "samples": len(rows),
            "located": int(rows["x"].notna().sum()),
            "flags": shares,
            "mean_rms": float(rms),
        }
        findings += _findings(str(name), shares, float(rms))
    return record, findings


def with_tagged(
    table: pd.DataFrame, tagged: pd.DataFrame, records: Mapping[str, Mapping[str, Any]]
) -> tuple[pd.DataFrame, dict[str, Any]]:
    """The table with the bodies that coded tags located behind the others, and the record of each of these bodies.

    tagged, records  as stage tag_poses gives them
    """
    own, _ = account(tagged)
    parts = [part for part in (table, tagged) if len(part)] or [tagged]
    return pd.concat(parts, ignore_index=True), {name: own[name] | records[name] for name in own}


def _findings(name: str, shares: Mapping[str, float], rms: float) -> list[Finding]:
    found = []
    for flag, meaning, cure in (
        (
            "misfit",
            f"its targets are not where a rigid body has them ({rms:.2g} rms)",
            "Measure the targets' coordinates in the body again; check that no two names are exchanged.",
        ),
        ("missing", "fewer than three of its targets were located", "Add targets to the body, or a camera."),
        ("collinear", "its located targets lie on one line", "Add a target off that line."),
    ):
        if (share := shares.get(flag, 0.0)) > SELDOM:
            level: Level = "bad" if share > 0.5 else "doubtful"
            text = f"body {name}: in {100 * share:.0f} % of the samples {meaning}"
            found.append(Finding(level, f"body-{flag}", text, cure))
    return found


def _one(trajectories: pd.DataFrame, name: str, targets: Mapping[str, Sequence[float]], where: str) -> pd.DataFrame:
    rows = trajectories[trajectories["target"].astype(str).isin(targets)]
    rows = rows.assign(target=rows["target"].astype(str), time=rows["time_s"].round(6)).drop_duplicates(
        ["time", "target"]
    )
    times = np.sort(rows["time"].unique())

    def grid(columns: tuple[str, ...]) -> np.ndarray[Any, np.dtype[np.float64]]:
        tables = [
            rows.pivot(index="time", columns="target", values=c).reindex(times, columns=list(targets)) for c in columns
        ]
        return np.stack([table.to_numpy(float) for table in tables], -1)

    sigma = grid(("sigma_x", "sigma_y", "sigma_z")) if "sigma_x" in rows else None
    if sigma is not None and not (np.isfinite(sigma) & (sigma > 0)).any():
        sigma = None
    try:
        pose = fit_pose(grid(("x", "y", "z")), np.array(list(targets.values()), float), sigma)
    except ValueError as problem:
        raise VidtrackError(f"{where}.{name}: {problem}. Name three or more, spread out.") from None
    codes = rows.drop_duplicates("time").set_index("time")["timecode"].reindex(times) if "timecode" in rows else ""
    flags = {"missing": pose.n_targets < 3, "collinear": pose.collinear, "misfit": pose.excess > MISFIT}
    flag = [";".join(word for word, is_so in flags.items() if is_so[i]) for i in range(len(times))]
    return pd.DataFrame(
        pose_columns(
            name,
            times,
            codes if isinstance(codes, str) else codes.to_numpy(),
            pose.origin,
            pose.R,
            pose.covariance,
            pose.rms,
            pose.n_targets,
            flag,
        )
    )

"""Located targets beside the truth: which one each is, by name or by place, and how large the errors are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.assignment import one_to_one
from vidtrack.findings import Finding
from vidtrack.timing.resample import resample


@dataclass(frozen=True)
class TruthSettings:
    """When places decide.

    better  times by which the median distance of all targets must fall
    fewest  samples of a target that its truth covers
    """

    better: float = 10.0
    fewest: int = 5


TRUTH = TruthSettings()


Paths = Mapping[str, tuple[Array, Array]]
"""Of each target: times (n,) s, ascending, and positions (n, 3) world units; z is NaN in a plane."""


def by_place(located: Paths, truth: Paths, by_name: Mapping[str, str]) -> dict[str, str] | None:
    """Located names to names of the truth by their places; None where the names agree with the places as they are.

    by_name  located name: name in the truth, of the targets that have one name in both
    """
    names, true_names = list(by_name), list(by_name.values())
    if len(names) < 2:
        return None
    cost = np.array([[_apart(located[n], truth[m]) for m in true_names] for n in names])
    chosen = one_to_one(cost)
    if (chosen < 0).any() or (chosen == np.arange(len(names))).all():
        return None
    rows = np.arange(len(names))
    if not np.diagonal(cost).sum() > TRUTH.better * cost[rows, chosen].sum():
        return None
    return {name: true_names[k] for name, k in zip(names, chosen.tolist(), strict=True)}


def exchanged(pairs: Mapping[str, str], named: bool = True) -> Finding:
    """What to say of names that differ: a note where targets were only counted, and have names of no meaning."""
    off = [f"{name} is where truth.csv has {true}" for name, true in pairs.items() if name != true]
    return Finding(
        "doubtful" if named else "note",
        "truth-names-differ",
        f"names do not agree with truth.csv: {', '.join(off[:6])}{' and so on' if len(off) > 6 else ''}; compared so",
        "Name the targets by start boxes in targets.csv, or correct the names in truth.csv.",
    )


def _apart(located: tuple[Array, Array], truth: tuple[Array, Array]) -> float:
    """Median distance of a located target from one of the truth; inf where they share too few samples."""
    (time, place), (known, true) = located, truth
    off = place - resample(known, true, time).values
    distance = np.sqrt(np.nansum(off**2, axis=1))[np.isfinite(off[:, :2]).all(axis=1)]
    return float(np.median(distance)) if len(distance) >= TRUTH.fewest else np.inf


def error_sizes(e: Array, z: Array, diagonal: float | None) -> dict[str, Any]:
    """Number, mean, rms, greatest and bias of errors e (n, 3), as a share of the diagonal too; z (n, 3) over sigma."""
    used = np.isfinite(e[:, :2]).all(1)
    e = e[used]
    if not len(e):
        return {"n": 0}
    length = np.sqrt(np.nansum(e**2, axis=1))
    axes = [k for k in range(3) if np.isfinite(e[:, k]).any()]
    about: dict[str, Any] = {"n": len(e), "mean": float(length.mean()), "rms": float(np.sqrt((length**2).mean()))}
    about["max"] = float(length.max())
    size = np.abs(e)
    for name, of_axes in (
        ("mean_abs", np.nanmean(size[:, axes], 0)),
        ("rms_by_axis", np.sqrt(np.nanmean(size[:, axes] ** 2, 0))),
        ("max_abs", np.nanmax(size[:, axes], 0)),
        ("bias", np.nanmean(e[:, axes], 0)),
    ):
        about[name] = {"xyz"[k]: float(v) for k, v in zip(axes, of_axes, strict=True)}
    z = z[used]
    about["normalised_variance"] = {
        "xyz"[k]: float(np.nanmean(z[:, k] ** 2)) for k in axes if np.isfinite(z[:, k]).any()
    }
    if diagonal is not None:
        about |= {"field_diagonal": float(diagonal), "one_over": float(diagonal / max(about["mean"], 1e-300))}
    return about

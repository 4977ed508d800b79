"""What the first page of the report says of a run: a few plain values, so that it reads no table of any run."""

from __future__ import annotations

from math import hypot
from typing import Any

from vidtrack.analysis.uncertainty import uncertainty_statement
from vidtrack.report.numbers import pick
from vidtrack.results import Results, RunResults


def run_summary(name: str, own: RunResults) -> dict[str, Any]:
    """run; samples and located ones; targets, length_s, sigma (all axes together, the mean over samples) and
    sigma_worst_axis where there are trajectories, else None; lag_s, lag_sd_s, rms (lag removed) against the contact
    sensor, and truth_one_over, where these were compared. Lengths in world units.
    """
    table = own.tables.get("trajectories")
    comparison = own.record("comparison")
    out: dict[str, Any] = dict.fromkeys(("targets", "length_s", "sigma", "sigma_worst_axis"))
    n, located = located_samples(own)
    if table is not None:
        sigma = [float(s) for s in table[["sigma_x", "sigma_y", "sigma_z"]].mean() if s == s]
        out["targets"] = int(table["target"].nunique())
        out["length_s"] = float(table["time_s"].max() - table["time_s"].min()) if n else None
        out["sigma"] = hypot(*sigma) if sigma else None
        out["sigma_worst_axis"] = max(sigma) if sigma else None
    return {
        "run": name,
        "samples": n,
        "located": located,
        **out,
        "lag_s": comparison.get("lag_s"),
        "lag_sd_s": comparison.get("lag_sd_s"),
        "rms": pick(comparison, "after", "rms"),
        "truth_one_over": pick(comparison, "truth", "one_over"),
    }


def run_uncertainty(name: str, results: Results) -> dict[str, Any]:
    """The uncertainty statement of a run; repeats are the other runs whose analysis is among the results."""
    own = results.runs.get(name, RunResults())
    analysed = own.record("analysis")
    each = [other.record("analysis").get("motions") or {} for other in results.runs.values()]
    budget = pick(own.record("locate"), "uncertainty", "axes")
    return uncertainty_statement(budget, analysed.get("motions") or {}, analysed.get("axes") or {}, each)


def located_samples(own: RunResults) -> tuple[int, int]:
    """How many samples a run has, and how many of them have a position (on transects: an edge of the water)."""
    table = own.tables.get("trajectories", own.tables.get("waterline"))
    return (0, 0) if table is None else (len(table), int(table["z" if "s" in table else "x"].notna().sum()))

"""The table of `python -m benchmarks`: this time's ratios beside last time's, and what became slower."""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

LEAST = 0.15
"""A ratio that changes by less than this share is as it was."""

SPREADS = 2.0
"""And by less than so many times the two spreads together."""


class Figure(NamedTuple):
    """One row: what was measured, beside what, both in the same unit, taking turns in one process.

    ours, theirs   the medians of the rounds, ms; less is better
    ratio          the median over the rounds of ours / theirs
    spread         half of the middle half of the rounds' ratios, as a share of their median
    """

    name: str
    peer: str
    ours: float
    theirs: float
    ratio: float
    spread: float

    @property
    def key(self) -> str:
        """What distinguishes it from other rows, this time and last time."""
        return f"{self.name} / {self.peer}"


def figure(name: str, peer: str, rounds: Sequence[tuple[float, float]]) -> Figure:
    """Of the times (ours, theirs) of each round, in ms."""
    ratios = sorted(ours / theirs for ours, theirs in rounds)
    ratio = statistics.median(ratios)
    low, high = statistics.quantiles(ratios, n=4)[::2] if len(ratios) > 1 else (ratio, ratio)
    ours, theirs = (statistics.median(side) for side in zip(*rounds, strict=True))
    return Figure(name, peer, ours, theirs, ratio, (high - low) / 2 / ratio)


def verdict(now: Figure, last: Mapping[str, Any] | None) -> str:
    """What became of a row since last time: SLOWER, faster, as it was, or new."""
    if last is None:
        return "new"
    change = now.ratio / last["ratio"]
    apart = max(LEAST, SPREADS * (now.spread + last["spread"]))
    if change > 1 + apart:
        return "SLOWER"
    return "faster" if change < 1 / (1 + apart) else "as it was"


def lines(now: Sequence[Figure], last: Mapping[str, Any] | None) -> list[str]:
    """The table as Markdown. last: what `as_record` gave last time, None where there was none."""
    before = (last or {}).get("figures", {})
    out = [
        "| what | beside | ms | of that, ms | ratio | last time | change | |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in now:
        old = before.get(row.key)
        was = f"{old['ratio']:.3g} | {100 * (row.ratio / old['ratio'] - 1):+.0f} %" if old else "- | -"
        out.append(
            f"| {row.name} | {row.peer} | {row.ours:.3g} | {row.theirs:.3g} "
            f"| {row.ratio:.3g} +- {100 * row.spread:.0f} % | {was} | {verdict(row, old)} |"
        )
    keys = {row.key for row in now}
    out += [
        f"| {key} | | | | | {old['ratio']:.3g} | | not measured |" for key, old in before.items() if key not in keys
    ]
    return out


def slower(now: Sequence[Figure], last: Mapping[str, Any] | None) -> list[str]:
    """The rows that became slower."""
    before = (last or {}).get("figures", {})
    return [row.key for row in now if verdict(row, before.get(row.key)) == "SLOWER"]


def as_record(now: Sequence[Figure], machine: Mapping[str, Any]) -> dict[str, Any]:
    """What next time's table is compared with."""
    return {"machine": dict(machine), "figures": {row.key: _rounded(row) for row in now}}


def _rounded(row: Figure) -> dict[str, float]:
    return {name: float(f"{getattr(row, name):.4g}") for name in ("ours", "theirs", "ratio", "spread")}


def read_record(path: Path) -> dict[str, Any] | None:
    """What was measured last time; None where there is no such file."""
    return json.loads(path.read_text()) if path.exists() else None


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n")


def machine() -> dict[str, Any]:
    """What the numbers depend on: processor, memory, system, versions, other work, and the commit."""
    packages = ("numpy", "opencv-python-headless", "av", "scipy", "pandas", "snakemake")
    return {
        "processor": _first(r"/proc/cpuinfo", "model name") or platform.processor() or platform.machine(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "memory_gb": round(int((_first("/proc/meminfo", "MemTotal") or "0 kB").split()[0]) / 2**20),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "packages": {name: version(name) for name in packages},
        "load": round(os.getloadavg()[0], 1),
        "date": time.strftime("%Y-%m-%d"),
        "commit": _commit(),
    }


def described(about: Mapping[str, Any]) -> str:
    """The machine, in a line."""
    packages = ", ".join(f"{name} {number}" for name, number in about["packages"].items())
    return (
        f"{about['date']}, commit {about['commit']}: {about['cores']} cores of {about['processor']}, "
        f"{about['memory_gb']} GB, {about['system']}, Python {about['python']}, {packages}; load {about['load']}"
    )


def _first(path: str, key: str) -> str | None:
    try:
        text = Path(path).read_text()
    except OSError:
        return None
    return next((line.partition(":")[2].strip() for line in text.splitlines() if line.startswith(key)), None)


def _commit() -> str:
    here = Path(__file__).parent
    answer = subprocess.run(
        ["git", "-C", here, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    return answer.stdout.strip() or "unknown"

"""Rows of tables as the page gets them: plain values, None for what is missing, since JSON has no NaN."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pandas import DataFrame


def rows_of(table: DataFrame, columns: Sequence[str]) -> list[dict[str, Any]]:
    """The rows of a table with those of the columns that it has."""
    rows = table[[name for name in columns if name in table]].to_dict("records")
    return [{str(k): None if v != v else v for k, v in row.items()} for row in rows]


def point_of(row: Mapping[Any, Any]) -> dict[str, Any]:
    """A named or calibrated point: where it is, px, how far off its projection lies, and why it is not used."""

    def number(name: str) -> float | None:
        value = row.get(name)
        return float(value) if value is not None and np.isfinite(value) else None

    reason = row.get("reason")
    return {
        "clip": row["clip"],
        "tag": str(row["tag"]),
        "Xf": number("Xf"),
        "Yf": number("Yf"),
        "residual_x": number("residual_x"),
        "residual_y": number("residual_y"),
        "used": bool(row.get("used", row["found"])),
        "reason": reason if isinstance(reason, str) else "",
    }

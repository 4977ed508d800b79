"""Rows of points.csv in one unit among rows in another, found by what the balls of a camera say of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vidtrack.arrays import Array
from vidtrack.errors import VidtrackError
from vidtrack.labelling.label import Index, Labels, agreeing, complete
from vidtrack.labelling.naming_doubts import LEAST_PICKS, Case
from vidtrack.labelling.seeds import label_from_picks

FACTORS = {
    25.4: "millimetres among inches",
    2.54: "centimetres among inches",
    10.0: "millimetres among centimetres, or a decimal point is one place off",
    12.0: "inches among feet",
    100.0: "centimetres among metres, or a decimal point is two places off",
    1000.0: "millimetres among metres, or a decimal point is three places off",
    1 / 0.3048: "feet among metres",
    1 / 0.0254: "inches among metres",
    304.8: "millimetres among feet",
    30.48: "centimetres among feet",
}
"""How many times too large coordinates may be, and what they then are."""
GAP, GAPS = 1.5, 5
"""Ratio of successive sizes that may part two units, and how many such gaps are tried."""
LIKE = 2.0
"""Times the size of the smaller rows that the larger ones may have in their unit."""
FEWEST_ROWS, MOST = 3, 0.7
"""Balls of either kind of rows that must be named, and the share of the smaller rows' balls."""
LISTED = 6


def check_units(case: Case) -> None:
    """Refuse points of which some rows fit only in another unit; for labels that fail otherwise.

    Raises VidtrackError, one line, where every pick and nearly every ball fit once those rows are divided.
    """
    if len(case.picks.point) < LEAST_PICKS:
        return
    for rows, factor in larger_rows(case.points):
        points = case.points.copy()
        points[rows] /= factor
        found = label_from_picks(points, case.views, case.picks, case.image_size, trusted=True)
        if not found or not _fits(case, found[0], rows):
            continue
        tags = [case.tags[i] for i in rows.tolist()]
        listed = ", ".join(tags[:LISTED]) + (" ..." if len(tags) > LISTED else "")
        raise VidtrackError(
            f"calibration/points.csv: the balls that camera {case.camera} sees fit only if the coordinates of "
            f"{len(tags)} of {len(points)} tags ({listed}) are divided by {factor:.5g}: {FACTORS[factor]}? Write all "
            "rows in one unit."
        )


def _fits(case: Case, labels: Labels, rows: Index) -> bool:
    """Whether labels leave no doubt and name balls of both kinds of rows: scaled alone, either kind fits by itself."""
    if not complete(labels, case.picks) or not agreeing(labels, case.picks).all():
        return False
    seen, large = np.concatenate(labels.blob) >= 0, np.isin(np.concatenate([v.points for v in labels.views]), rows)
    return bool(min(seen[large].sum(), seen[~large].sum()) >= FEWEST_ROWS and seen[~large].mean() >= MOST)


def larger_rows(points: Array) -> Iterator[tuple[Index, float]]:
    """Rows of points (m, 3) that may be in a smaller unit than the others, all axes, and how many times too large."""
    size = np.abs(points).max(-1)
    order = np.argsort(size, kind="stable")
    ratio = size[order][1:] / np.maximum(size[order][:-1], 1e-9 * size.max(initial=0.0) + 1e-300)
    for k in np.argsort(-ratio, kind="stable")[:GAPS].tolist():
        small, large = order[: k + 1], np.sort(order[k + 1 :])
        if ratio[k] < GAP or not len(small):
            continue
        for factor in FACTORS:
            if 1 / LIKE <= size[large].max() / factor / max(size[small].max(), 1e-300) <= LIKE:
                yield large, factor

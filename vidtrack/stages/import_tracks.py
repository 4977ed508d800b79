"""Stage import_tracks: positions that another program digitised become the tables of a tracked recording.

done = import_tracks(["ball"], frame, b, time_base(Fraction(30)), named=True)
done.centroids[["time_s", "Xf", "Yf", "sd_x"]]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vidtrack.arrays import Array
from vidtrack.association.tracklets import COLUMNS, ends_of_tracks
from vidtrack.errors import VidtrackError
from vidtrack.findings import Finding
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.quality.tracking_quality import pixel_locking
from vidtrack.tracking.uncertainty.empirical_sd import rms_error

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Digits:
    """How the sd of digitised positions is estimated.

    whole    share of the coordinates that are whole numbers from which on all were rounded to such
    rounded  px, standard deviation of what rounding to whole numbers takes away
    least    px, a track that is smoother was filtered, and its errors do not show in it
    """

    whole: float = 0.9
    rounded: float = 1 / 12**0.5
    least: float = 0.02


DIGITS = Digits()


class Imported(NamedTuple):
    """What the stage gives: tables as those of stage track, a record, and findings."""

    centroids: DataFrame
    tracklets: DataFrame
    record: dict[str, Any]
    findings: list[Finding]


def import_tracks(
    names: Sequence[str],
    frame: ArrayLike,
    b: ArrayLike,
    clock: TimeBase,
    *,
    named: bool,
    sd: float | None = None,
    camera: str = "",
    where: str = "tracks",
) -> Imported:
    """The tables of a camera's tracks.

    names   n targets; frame (k,) numbers of pictures, rising; b (k, n, 2) px in the frame buffer, NaN where not found
    clock   of the recording: the time of a frame is that of its number over the rate
    named   whether a name means one target in all cameras; else each gets the camera's before it
    sd      px, one standard deviation of all positions; None: estimated for each target and axis from how its track
            scatters (differences of 4th to 10th order), never below what rounding takes
    where   of the run in the config, for messages
    Raises VidtrackError where no track is long enough to show its errors and no sd is given.
    """
    from pandas import DataFrame

    frame, b = np.asarray(frame, np.int64), np.asarray(b, float)
    k, n = b.shape[:2]
    seen = np.isfinite(b).all(-1)
    each, findings = _sd(b, frame, sd, names, where)
    labels = [str(name) if named else f"{camera}-{name}" for name in names]
    time = frame / float(clock.rate)
    row, column = np.repeat(np.arange(k), n), np.tile(np.arange(n), k)

    nothing = np.full(k * n, np.nan)
    flat = np.where(seen[..., None], b, np.nan).reshape(-1, 2)
    table = DataFrame(
        {
            "frame": frame[row],
            "field": _words(["frame"], np.zeros(k * n, np.intp)),
            "time_s": clock.seconds(time)[row],
            "timecode": _words(clock.labels(time).astype(object), row),
            "target": _words(labels, column),
            "Xf": flat[:, 0],
            "Yf": flat[:, 1],
            "sd_x": np.where(seen.ravel(), each[0][column], np.nan),
            "sd_y": np.where(seen.ravel(), each[1][column], np.nan),
            **dict.fromkeys(("pixels", "total_pixels", "mass", "contrast", "background"), nothing),
            **dict.fromkeys(("box_x", "box_y", "box_w", "box_h"), nothing),
            "flag": _words(["lost", ""], seen.ravel().astype(np.intp)),
        }
    )
    tracklets = _tracklets(table, b, named)
    share = seen.mean(axis=0) if k else np.zeros(n)
    record = {
        "samples": k,
        "measured": float(share.mean()) if n else 0.0,
        "targets": {
            label: {"measured": float(share[i]), "flags": {"lost": float(1 - share[i])} if share[i] < 1 else {}}
            for i, label in enumerate(labels)
        },
        "sd": {label: {"x": float(each[0][i]), "y": float(each[1][i])} for i, label in enumerate(labels)},
        "sd_source": "config" if sd is not None else "differences of the tracks",
        "pixel_locking": {axis: pixel_locking(b[..., i]) for i, axis in enumerate("xy")},
        "problems": [],
        "worst": [],
    }
    findings += _unseen(labels, share)
    return Imported(table, tracklets, record, findings)


def _tracklets(table: DataFrame, b: Array, named: bool) -> DataFrame:
    """The tracklets of regular tracks: one ends where a target is missing for long."""
    row, number, began, ended = ends_of_tracks(b)
    out = table.take(row).reset_index(drop=True)
    out["tracklet"], out["began"], out["ended"] = number, _words(began, number), _words(ended, number)
    return out.assign(met="", bound=named, brightness=np.nan)[list(COLUMNS)]


def _words(of: Sequence[str] | NDArray[Any], which: NDArray[np.intp]) -> Any:
    """Words by their places, as a column of text; much faster than an array of objects."""
    from pandas import Series

    return Series(np.array(of, object), dtype="str").array.take(which)


def _sd(
    b: Array, frame: NDArray[np.int64], sd: float | None, names: Sequence[str], where: str
) -> tuple[Array, list[Finding]]:
    """The sd (2, n) of each target in X and Y, px."""
    n = b.shape[1]
    if sd is not None:
        return np.full((2, n), float(sd)), []
    own = rms_error(np.moveaxis(b, 2, 0), frame.astype(float)) if len(b) else np.full((2, n), np.nan)
    if not np.isfinite(own).all(axis=0).any():
        raise VidtrackError(
            f"config.yaml: {where}.detect.sd: no track has enough samples in a row to show its errors. Give sd: one "
            "standard deviation of the digitised positions in px, as in detect: {sd: 0.3}."
        )
    usual = np.nanmedian(own, axis=1, keepdims=True)
    own = np.where(np.isfinite(own), own, usual)
    known = b[np.isfinite(b)]
    floor = DIGITS.rounded if (known == np.rint(known)).mean() >= DIGITS.whole else DIGITS.least
    smooth = [bool((own[:, i] < floor).any()) for i in range(n)]
    own = np.maximum(own, floor)
    x, y = np.median(own, axis=1)
    text = (
        f"the sd of digitised positions is not known; how their tracks scatter shows {x:.2g} px in X, {y:.2g} px in Y "
        "(median of the targets)"
    )
    level = "note"
    if any(smooth) and floor == DIGITS.least:
        level = "doubtful"
        text += f"; {', '.join(str(name) for name, s in zip(names, smooth, strict=True) if s)}: smoothed before"
    finding = Finding(level, "sd-estimated", text, "Give detect.sd where it is known.")  # type: ignore[arg-type]
    return own, [finding]


def _unseen(labels: Sequence[str], share: Array) -> list[Finding]:
    never = [label for label, some in zip(labels, share, strict=True) if not some]
    if not never:
        return []
    text = f"{', '.join(never[:8])}{' ...' * (len(never) > 8)}: the file has no position in any frame"
    return [Finding("note", "target-never-digitised", text, "Remove from the file the names that are not targets.")]

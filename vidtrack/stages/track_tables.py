"""The tables that the track stage writes: centroids, tracklets and pieces of pictures for a second search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vidtrack.arrays import Array
from vidtrack.association.tracklets import COLUMNS
from vidtrack.memory import tables_from_c_library
from vidtrack.side_by_side import side_by_side
from vidtrack.timing.timebase import TimeBase
from vidtrack.tracking.frame_times import Moments
from vidtrack.tracking.measurement.lighting import Lighting
from vidtrack.tracking.state import BACKGROUND, CONTRAST, FLAGS, PIXELS, SD_X, SD_Y, Rows, Starts, X, Y
from vidtrack.tracking.track_cuts import CutTracks
from vidtrack.tracking.tracking_quality import described
from vidtrack.tracking.windows import COLUMNS as WINDOW_COLUMNS
from vidtrack.tracking.windows import Window

if TYPE_CHECKING:
    from pandas import DataFrame

CENTROIDS = (
    *("frame", "field", "time_s", "timecode", "target", "Xf", "Yf", "sd_x", "sd_y", "pixels", "total_pixels"),
    *("mass", "contrast", "background", "box_x", "box_y", "box_w", "box_h", "flag"),
)
"""Columns of the table of centroids, as `track` says."""
_MEASURED = "Xf", "Yf", "sd_x", "sd_y", "pixels", "mass", "contrast", "background"


class SampleColumns:
    """The columns that say which sample a row is of; flags: the words of all flags."""

    def __init__(self, moment: Moments, clock: TimeBase) -> None:
        tables_from_c_library()
        self.frame = moment.frame
        self.time_s = clock.seconds(moment.time, fields=moment.offset)
        field, self._fields = np.unique(moment.field.astype(str), return_inverse=True)
        self._field, self._labels = _as_column(field), _as_column(clock.labels(moment.time))
        self.flags = _as_column(described(np.arange(1 << len(FLAGS)), FLAGS))

    def of(self, sample: NDArray[np.intp]) -> dict[str, Any]:
        """Those of some samples (rows,), for `_written`."""
        return {
            "frame": self.frame[sample],
            "field": _Words(self._field, lambda: self._fields[sample]),
            "time_s": self.time_s[sample],
            "timecode": _Words(self._labels, lambda: sample),
        }


class _Words(NamedTuple):
    """A column of words that is not written out yet: the words, and what says which of them each row has."""

    words: Any
    which: Callable[[], NDArray[np.intp]]


def _written(columns: dict[str, Any], names: Sequence[str]) -> DataFrame:
    """The table of those columns that are named, words written out side by side."""
    from pandas import DataFrame

    words = {name: columns[name] for name in names if isinstance(columns[name], _Words)}
    written = side_by_side(lambda column: column.words.take(column.which()), list(words.values()))
    columns = columns | dict(zip(words, written, strict=True))
    return DataFrame({name: columns[name] for name in names}, copy=False)


def _as_column(words: Sequence[str] | NDArray[Any]) -> Any:
    """Words as pandas keeps them, in a fifth of the memory of as many objects; rows of a table take theirs of them."""
    from pandas import Series

    return Series(np.array(words, object)).array


def centroid_table(rows: Rows, columns: SampleColumns, names: list[str], starts: Starts) -> DataFrame:
    """The table of centroids, as `track` says."""
    k, n = rows.flag.shape
    return _written(
        {
            **columns.of(np.repeat(np.arange(k), n)),
            "target": _Words(_as_column(names), lambda: np.tile(np.arange(n), k)),
            **dict(zip(_MEASURED, (values.ravel() for values in rows.values[: BACKGROUND + 1]), strict=True)),
            "total_pixels": np.repeat(rows.total_pixels, n),
            "box_x": rows.corner[..., 0].ravel(),
            "box_y": rows.corner[..., 1].ravel(),
            "box_w": np.tile(starts.box[:, 0], k),
            "box_h": np.tile(starts.box[:, 1], k),
            "flag": _Words(columns.flags, rows.flag.ravel),
        },
        CENTROIDS,
    )


def tracklet_table(cut: CutTracks, columns: SampleColumns, names: list[str], in_boxes: bool) -> DataFrame:
    """The table of tracklets; in_boxes: the user has named where each target begins."""
    each = cut.tracklet
    table = {
        **columns.of(cut.sample),
        "tracklet": each,
        "Xf": cut.values[X],
        "Yf": cut.values[Y],
        "sd_x": cut.values[SD_X],
        "sd_y": cut.values[SD_Y],
        "pixels": cut.values[PIXELS],
        "brightness": cut.values[CONTRAST],
        "flag": _Words(columns.flags, lambda: cut.flag),
        "began": _Words(_as_column(cut.began), lambda: each),
        "ended": _Words(_as_column(cut.ended), lambda: each),
        "met": _Words(_as_column(cut.met), lambda: each),
        "target": _Words(_as_column([*names, ""]), lambda: cut.target[each]),
        "bound": (in_boxes & (cut.began == "first") & (cut.target >= 0))[each],
    }
    return _written(table, COLUMNS)


def window_table(
    kept: Sequence[Window],
    columns: SampleColumns,
    noise: float,
    grown: Array,
    exposure: float,
    lit: Lighting | None = None,
) -> DataFrame:
    """The table of pieces of pictures; noise: grey levels, of a pixel; grown (2,): of sd_x, sd_y; exposure: samples;
    lit: how targets are lit, where that is from one side.
    """
    kept = sorted(kept, key=lambda one: one.sample)
    sample = np.array([one.sample for one in kept], np.intp)
    alike = {"noise": noise, "grown_x": grown[0], "grown_y": grown[1], "exposure": exposure}
    way = np.zeros((3, len(kept)))
    if lit is not None and kept:
        corner = np.array([[one.left, one.top * one.lines + one.parity] for one in kept], float).T
        size = np.array([[one.grey.shape[1], one.grey.shape[0] * one.lines] for one in kept], float).T
        way[:2], way[2] = lit.ways(-1, corner + size / 2, np.ones(len(kept)))
    table = columns.of(sample) | {
        **{key: np.array([getattr(one, key) for one in kept], np.int64) for key in ("left", "top", "parity", "lines")},
        "width": np.array([one.grey.shape[1] for one in kept], np.int64),
        "grey": np.array([one.grey.tobytes() for one in kept], object),
        **{name: np.full(len(kept), value) for name, value in alike.items()},
        **dict(zip(("lit_x", "lit_y", "lit_sd"), way, strict=True)),
    }
    return _written(table, WINDOW_COLUMNS)

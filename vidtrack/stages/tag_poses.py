"""Stage tag_poses: corners of coded tags in all cameras become tables of the poses of bodies. See `tags.poses`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import vidtrack.tags.poses as room
from vidtrack.memory import columns_of
from vidtrack.tags.poses import TagOrder, TagPoses, pose_rows

if TYPE_CHECKING:
    from pandas import DataFrame


def tag_poses(
    centroids: Mapping[str, DataFrame],
    calibrated: Mapping[str, Any],
    order: TagOrder,
    *,
    trajectories: DataFrame | None = None,
    **known: Any,
) -> TagPoses:
    """`tags.poses.tag_poses` of tables: centroids a camera, trajectories of other targets; known: as it has them."""
    located = None if trajectories is None else columns_of(trajectories)
    tables = {name: columns_of(table) for name, table in centroids.items()}
    return room.tag_poses(tables, calibrated, order, trajectories=located, **known)


def table_of(done: TagPoses) -> DataFrame:
    """The poses as rows of bodies.parquet, and n_cameras."""
    import pandas as pd

    return pd.concat([pd.DataFrame(part) for part in pose_rows(done)], ignore_index=True)

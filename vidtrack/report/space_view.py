"""The rig and the targets in space, as JSON that `templates/report.js` draws: cameras, survey, trajectories, sigmas."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from vidtrack.arrays import Array
from vidtrack.figures.style import PALETTE, magnification
from vidtrack.files.camera_json import interface_from_record
from vidtrack.geometry.camera import Camera, line_of_sight
from vidtrack.geometry.lens_terms import COEFFICIENTS
from vidtrack.report.numbers import plain
from vidtrack.results import Results

if TYPE_CHECKING:
    from pandas import DataFrame

MOST = 1500
"""Samples of each target that the view holds, at most."""


def space_view(
    results: Results, trajectories: DataFrame | None, colours: Mapping[str, str], units: str
) -> dict[str, Any]:
    """What there is in space.

    cameras   name, colour, centre and the corners of its view at the distance of the points
    points    surveyed, and hull: pairs of them, the edges of the calibrated volume
    tracks    of each target p and s (the sigmas), at `times` after t0; None where it is not located
    magnified   by how much ellipsoids of one sigma are drawn larger
    """
    points = _survey(results)
    middle = points.mean(0) if len(points) else np.zeros(3)
    cameras = [
        {"name": name, "colour": colours.get(name, PALETTE[-1])} | _frustum(own.record, middle)
        for name, own in results.cameras.items()
        if own.record and "R" in own.record
    ]
    data: dict[str, Any] = {"kind": "space", "units": units, "cameras": cameras, "points": _rows(points)}
    data |= {"hull": _hull(points), "t0": 0.0, "times": [], "tracks": [], "magnified": 1.0}
    return data | (_tracks(trajectories) if trajectories is not None and len(trajectories) else {})


def as_json(data: Mapping[str, Any]) -> str:
    """The view as it stands in the page."""
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def camera_of(record: Mapping[str, Any]) -> Camera:
    """The camera of a camera.json, with the lens terms that it has."""
    terms = {name: record[name] for name in ("Cx", "Cy", "dx", "dy", "Sx", "f", *COEFFICIENTS) if name in record}
    width, height = record["image_size"]
    R, T = (np.asarray(record[name], float) for name in ("R", "T"))
    through = tuple(interface_from_record(own) for own in record.get("through", ()))
    return Camera(**terms, R=R, T=T, image_size=(width, height), through=through)


def _survey(results: Results) -> Array:
    table = next((own.points for own in results.cameras.values() if own.points is not None), None)
    if table is None:
        return np.zeros((0, 3))
    p = table.drop_duplicates("tag")[["x", "y", "z"]].to_numpy(float)
    return np.asarray(p[np.isfinite(p).all(axis=1)])


def _rows(p: Array) -> list[list[float | None] | None]:
    rows = zip(*[iter(plain(p.ravel()))] * 3, strict=True)
    return [None if None in row else list(row) for row in rows]


def _frustum(record: Mapping[str, Any], middle: Array) -> dict[str, Any]:
    """Centre and the corners of the view, a third of the way to the points."""
    camera = camera_of(record).without_lens().with_(through=())
    (width, height), R = camera.image_size, camera.R
    corners = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
    centre = camera.position
    ray = line_of_sight(camera, corners)[1]
    ahead = ray @ R[2]
    return {"centre": plain(centre), "corners": _rows(centre + ray / ahead[:, None] * (R[2] @ (middle - centre)) / 3)}


def _hull(points: Array) -> list[list[int]]:
    """Edges of the convex hull between faces that are not in one plane; none where the points span no volume."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 4:
        return []
    try:
        hull = ConvexHull(points)
    except QhullError:
        return []
    faces: dict[tuple[int, int], list[int]] = {}
    for k, simplex in enumerate(hull.simplices):
        for i in range(3):
            a, b = sorted((int(simplex[i]), int(simplex[i - 1])))
            faces.setdefault((a, b), []).append(k)
    n = hull.equations[:, :3]
    return [list(edge) for edge, (a, b) in faces.items() if float(n[a] @ n[b]) < 1 - 1e-3]


def _tracks(table: DataFrame) -> dict[str, Any]:
    """The targets on common times: those of all samples, thinned."""
    every = max(1, -(-table["time_s"].nunique() // MOST))
    times = np.sort(table["time_s"].unique())[::every]
    t0 = float(np.floor(times[0]))
    tracks, sigmas = [], []
    for i, (name, rows) in enumerate(table.groupby("target", sort=False)):
        own = rows.drop_duplicates("time_s").set_index("time_s").reindex(times)
        p = own[["x", "y", "z"]].fillna({"z": 0.0} if own["z"].isna().all() else {}).to_numpy(float)
        s = own[[f"sigma_{a}" for a in "xyz"]].to_numpy(float)
        sigmas.append(s)
        tracks.append({"name": str(name), "colour": PALETTE[i % len(PALETTE)], "p": _rows(p), "s": _rows(s)})
    p = table[["x", "y", "z"]].to_numpy(float)
    size = float(np.nanmax(np.nanmax(p, axis=0) - np.nanmin(p, axis=0), initial=0.0)) if np.isfinite(p).any() else 0.0
    magnified = magnification(np.concatenate(sigmas).ravel(), size / 12) if size else 1.0
    return {"t0": t0, "times": plain(np.round(times - t0, 5), 9), "tracks": tracks, "magnified": magnified}

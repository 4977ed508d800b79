"""Job import_camera: a camera that another program calibrated -> camera.json, and tables without points."""

from __future__ import annotations

from typing import Any

import numpy as np

from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said, in_world, stated_uncertainty
from vidtrack.files.camera_json import write_camera
from vidtrack.files.records import write_json
from vidtrack.files.tables import write_parquet
from vidtrack.findings import as_records
from vidtrack.workflow.job import Job


def run(job: Job) -> None:
    """input file; settings camera, units and what the config says of the file; outputs camera, points, labelling."""
    order = job.settings
    said = Said.of(order)
    given = read_camera(job.path("file"), said)
    camera = in_world(given, said)
    sigma = order.get("sigma_px")
    known, findings = stated_uncertainty(given, said, sigma)
    extra: dict[str, Any] = {
        "model": "imported",
        "imported": {
            "format": given.format,
            "largest_px": given.largest_px,
            "unit": given.unit or said.units or said.world,
        },
        "units": said.world,
        "refine": "none",
        "n_points": 0,
        "sigma_px": sigma,
        "settings": order,
        "findings": as_records(findings),
        "warnings": [f"{each.text}. {each.cure}" for each in findings if each.level != "note"],
    }
    write_camera(job.outputs["camera"], camera, known, extra, job.provenance)
    write_parquet(job.outputs["points"], _no_points(), units=said.world, provenance=job.provenance)
    write_json(job.outputs["labelling"], {"pictures": {}, "findings": []}, job.provenance)


def _no_points() -> Any:
    from pandas import DataFrame

    words = dict.fromkeys(("clip", "tag"), np.zeros(0, object))
    real = ("x", "y", "z", "sigma", "Xf", "Yf", "sd_x", "sd_y", "pixels", "residual_x", "residual_y")
    columns = words | dict.fromkeys(real, np.zeros(0)) | {"frames": np.zeros(0, np.int64)}
    return DataFrame(columns | {"used": np.zeros(0, bool), "found": np.zeros(0, bool), "reason": np.zeros(0, object)})

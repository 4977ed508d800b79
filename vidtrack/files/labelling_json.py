"""labelling.json: how a camera's calibration points were found and named."""

from __future__ import annotations

from typing import Any

from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json


def read_labelling(path: str) -> dict[str, Any]:
    """The record; raises VidtrackError with the reasons where no point of the camera could be labelled."""
    record = read_json(path)
    if record.get("failed"):
        raise VidtrackError(*record["failed"])
    return record

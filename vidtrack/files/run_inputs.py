"""What the records of a run and of its calibration say of each camera's pictures: their sizes, how they are read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import read_json
from vidtrack.geometry.picture_part import Picture, picture_from_record
from vidtrack.location.cameras.run_pictures import Pictures


def pictures_of(
    names: Sequence[str],
    labelling: Iterable[str],
    readings: Iterable[str],
    sizes: Mapping[str, Picture],
    crops: Mapping[str, Sequence[float]],
) -> dict[str, Pictures]:
    """What is known of each camera's pictures: of the calibration, from its labelling, and of the run.

    labelling, readings   paths, in the order of the names
    sizes                 of the calibration's pictures, where the labelling says nothing of them
    """
    clips = {n: read_labelling(path).get("pictures") for n, path in zip(names, labelling, strict=False)}
    runs = {n: read_json(path).get("video") for n, path in zip(names, readings, strict=False)}
    pictures = {}
    for name, run in runs.items():
        known = clips.get(name)
        calibrated = picture_from_record(next(iter(known.values()))) if known else sizes.get(name)
        if run and calibrated is not None:
            pictures[name] = Pictures(calibrated, picture_from_record(run), crops.get(name))
    return pictures


def videos_of(names: Sequence[str], readings: Iterable[str]) -> dict[str, Mapping[str, Any]]:
    """What the record of each camera's reading says of its recording; cameras whose tracks came alone are left out."""
    each = {name: read_json(path).get("video") for name, path in zip(names, readings, strict=False)}
    return {name: video for name, video in each.items() if video}

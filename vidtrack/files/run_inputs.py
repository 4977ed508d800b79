"""What the records of a run and of its calibration say of each camera's pictures: their sizes, how they are read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import read_json
from vidtrack.geometry.picture_part import Picture, picture_from_record
from vidtrack.location.run_pictures import Pictures
from vidtrack.timing.readout import Readout


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


def readouts_of(names: Sequence[str], readings: Iterable[str], said: Mapping[str, float | str]) -> dict[str, Readout]:
    """How each camera reads its picture: as the config says (ms), else, and where it is sought, all rows at once."""
    out = {}
    for name, path in zip(names, readings, strict=False):
        video: Mapping[str, Any] = read_json(path).get("video") or {}
        if video:
            size = (int(video["width"]), int(video["height"]))
            turn = int(video.get("rotation", 0)), bool(video.get("mirrored", False))
            ms = said.get(name, 0.0)
            out[name] = Readout(0.0 if isinstance(ms, str) else ms / 1e3, size, *turn)
    return out

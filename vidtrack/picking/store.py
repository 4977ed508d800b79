"""The files that the page writes: picks.csv, targets.csv and the detect keys of config.yaml, each whole or not at all.

A page says which content of a file it has seen. Where another window, or a person, has changed it meanwhile, nothing is
written.
"""

from __future__ import annotations

import csv
import hashlib
import io
import os
from collections.abc import Mapping, Sequence
from typing import Any

from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import replacing

PICKS = ("camera", "tag", "Xf", "Yf", "sd")
TARGETS = ("camera", "target", "Xf", "Yf", "width", "height")


class Outdated(VidtrackError):
    """A file is no longer as the page has seen it."""


def version_of(path: str) -> str:
    """A checksum of a file's content; "" where there is none."""
    if not os.path.isfile(path):
        return ""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def check_version(path: str, seen: str) -> None:
    """Raise Outdated where the content is another than was seen."""
    if version_of(path) != seen:
        raise Outdated(f"{path}: was changed by another window or program. Load the page again.")


def write_rows(path: str, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table for people; empty cells for what is missing, optional columns left out where all are empty.

    Without rows the file is removed: a header alone is no table.
    """
    if not rows:
        if os.path.isfile(path):
            os.unlink(path)
        return
    used = [name for name in columns if any(row.get(name) not in (None, "") for row in rows)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(used)
    for row in rows:
        writer.writerow([_cell(row.get(name)) for name in used])
    with replacing(path) as file:
        file.write(text.getvalue().encode())


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.2f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)


def change_detect(path: str, place: Sequence[str], changes: Mapping[str, Any]) -> None:
    """Set detect keys in config.yaml, with all its comments kept; None takes a key away.

    place   of the section that holds `detect`: (), ("runs", "pluck"), ("calibration", "clips", "row1")
    Raises VidtrackError, nothing written, where the result is no config that vidtrack takes.
    """
    _change(path, [*place, "detect"], changes)


def change_clip(path: str, clip: str, changes: Mapping[str, Any]) -> None:
    """Set keys of a calibration clip, such as its tags, in config.yaml; None takes a key away."""
    _change(path, ["calibration", "clips", clip], changes)


def _change(path: str, place: Sequence[str], changes: Mapping[str, Any]) -> None:
    import yaml
    from ruamel.yaml import YAML
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    from vidtrack.settings.config import settings_from_config

    round_trip = YAML()
    round_trip.preserve_quotes = True
    round_trip.width = 1 << 16
    with open(path, encoding="utf-8") as file:
        config = round_trip.load(file)
    node = config
    for part in place:
        key = next((k for k in node if str(k) == part), part)  # a run named 12 is a number in YAML
        if node.get(key) is None:
            node[key] = CommentedMap()
        node = node[key]
    for key, value in changes.items():
        if value is None:
            node.pop(key, None)
        elif isinstance(value, (list, tuple)):
            node[key] = row = CommentedSeq(value)
            row.fa.set_flow_style()
        else:
            node[key] = value
    text = io.StringIO()
    round_trip.dump(config, text)
    settings_from_config(yaml.safe_load(text.getvalue()))
    with replacing(path) as file:
        file.write(text.getvalue().encode())

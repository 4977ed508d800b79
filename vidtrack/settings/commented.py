"""config.yaml with every key: those that are given as they are, all others as comments with meaning and default."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from vidtrack.settings.config import Settings
from vidtrack.settings.detection import DetectChange

WIDTH = 110
"""Characters of a line."""

EXAMPLES: dict[str, str] = {
    "Cx": "255.5",
    "Cy": "239.5",
    "sensor": "[8.8, 6.6]",
    "crop": "[0, 0, 640, 480]",
    "detect": "{threshold: 120}",
    "clock": "{offset_s: 0.0, rate_ppm: 0.0}",
    "tags": "1-16",
    "period": "1.2",
    "resolution": "0.02",
    "series": "t1.x",
    "motion": "potentiometer_V",
    "start": "null",
    "end": "null",
    "waves": "+x",
    "up": "+z",
    "elevation": "gauge",
    "file": "channels.csv",
    "columns": "{gauge: eta_m}",
    "targets": "1",
    "scale": "0.14",
    "plane.aspect": "1.25",
    "points": "calibration/points.csv",
    "clip": "plate",
    "value": "x_in",
    "target": "t1",
    "offset_s": "0.0",
    "camera": "cam1",
    "transects": "{profile1: {from: [0, 0, 0], to: [10, 0, 1], step: 0.01, profile: beach.csv}}",
    "bodies": "{float: {a: [0, 0, 0], b: [6, 0, 0], c: [0, 6, 0], points: {CoG: [2, 2, 0]}, "
    "tags: {7: {centre: [3, 3, 2], normal: [0, 0, 1]}}}}",
    "videos": "{cam1: elsewhere/cam1.mp4}",
    "start_timecode": '"10:00:00:00"',
    "tolerance_px": "3",
    "max_miss": "0.5",
    "model": "auto",
    "fix": "[Sx]",
    "prior": "{f: [8.0, 0.05]}",
    "through": "window",
    "interfaces": "{window: {point: [0, 0, 0], normal: [0, 1, 0], thickness: 0.5, indices: [1.0, 1.49, 1.333], "
    "sigma: {position: 0.1, tilt: 0.5, index: 0.001}}}",
    "after": "[row1_after]",
    "quadratic": "true",
    "colour": "{hue: 0, width: 40}",
    "rate": "240",
    "stream": "1",
    "calibration.board": "{type: charuco, columns: 8, rows: 6, square: 30}",
    "board.columns": "8",
    "board.rows": "6",
    "board.square": "30",
    "board.marker": "22.5",
    "board.dictionary": "DICT_5X5_250",
    "board.clips": "[board]",
    "board.world": "board/0",
    "calibration.lens": "{file: calibration/lens.yml, use: fixed}",
    "use": "fixed",
    "fx": "1450.0",
    "fy": "1450.0",
    "cx": "639.5",
    "cy": "359.5",
    "image_size": "[1280, 720]",
    "lens.sd": "{fx: 1.5, cx: 2.0}",
    "calibration.self": "{body: float, runs: [heave], sigma: 0.01}",
    "self.body": "float",
    "self.runs": "[heave]",
    "self.sigma": "0.01",
    "calibration.wand": "{lengths: {A-B: 20.0}, sigma: 0.01, axes: {origin: bob, up: [bob, hook], x: [left, right]}}",
    "wand.lengths": "{A-B: 20.0}",
    "wand.clip": "wand",
    "wand.sigma": "0.01",
    "wand.axes": "{origin: bob, up: [bob, hook], x: [left, right]}",
    "wand.axes.origin": "bob",
    "wand.axes.x": "[left, right]",
    "wand.axes.y": "[near, far]",
    "wand.axes.up": "[bob, hook]",
    "wand.axes.level": "[w1, w2, w3]",
    "wand.axes.drop": "fall",
    "<tag>.up": "[0, 1, 0]",
    "tags.family": "36h11",
    "tags.size": "4",
    "tags.ids": "[7, 9]",
    "title": "my experiment",
}
"""What stands behind a key that has no default, or an empty one, in the comment that shows it, by its path's end."""


def by_end(path: str, examples: Mapping[str, str]) -> str | None:
    """The example whose key is the longest end of a path."""
    fits = [end for end in examples if path == end or path.endswith(f".{end}")]
    return examples[max(fits, key=len)] if fits else None


def commented_config(values: Mapping[str, Any], head: str = "") -> str:
    """The text of a config.yaml that holds `values` and, as comments, every other key.

    A key is commented out by a lone #, what it means stands behind # and a space. Under cameras, clips and runs the
    comments stand under the first name only.
    """
    lines = [f"# {line}" if line else "#" for line in head.splitlines()]
    lines += _section(Settings, values, "", "", "")
    return "\n".join(lines) + "\n"


def _section(model: type[BaseModel], values: Mapping[str, Any], path: str, indent: str, mark: str) -> Iterator[str]:
    """The lines of a section at a path. mark   "#" where all of it is a comment"""
    for name, field in model.model_fields.items():
        if issubclass(model, DetectChange) and name in DetectChange.model_fields and name not in values:
            continue  # they stand under `detect`
        yield from _key(field.alias or name, field, values, path, indent, mark)


def _key(name: str, field: FieldInfo, values: Mapping[str, Any], path: str, indent: str, mark: str) -> Iterator[str]:
    here = f"{path}.{name}"
    inner, many = inner_section(field)
    given = name in values and (bool(values[name]) or not many)  # no clip at all: an example as comment
    mark = mark if given else "#"
    if not indent:
        yield ""
    for line in textwrap.wrap(field.description or "", WIDTH - len(indent) - 2):
        yield f"{indent}# {line}"
    value = values.get(name)
    if inner is not None and many and (given or name in ("cameras", "clips", "runs")):
        yield f"{indent}{mark}{name}:"
        entries = list((value or {"name": {}}).items())
        for i, (key, own) in enumerate(entries):
            if i and not own:
                yield f"{indent}  {mark}{key}: {{}}"
                continue
            yield f"{indent}  {mark}{key}:"
            if i:
                yield from (f"{indent}    {mark}{k}: {flow(v)}" for k, v in own.items())
            else:
                yield from _section(inner, own or {}, here, indent + "    ", mark)
    elif inner is not None and not many and inner is not DetectChange and _alone(field.annotation):
        yield f"{indent}{mark}{name}:"
        yield from _section(inner, value or {}, here, indent + "  ", mark)
    else:
        yield f"{indent}{mark}{name}: {flow(value) if given else _shown(here, field)}"


def inner_section(field: FieldInfo) -> tuple[type[BaseModel] | None, bool]:
    """The section that a key holds, None for plain values, and whether it holds many under names."""
    many = "dict[" in str(field.annotation)
    todo: list[Any] = [field.annotation]
    while todo:
        part = todo.pop(0)
        if isinstance(part, type) and issubclass(part, BaseModel):
            return part, many
        todo += get_args(part)
    return None, False


def _alone(annotation: Any) -> bool:
    """Whether a section is all that may stand there, and no word or number instead of it."""
    parts = [part for part in get_args(annotation) if part is not type(None)]
    return len(parts) < 2 or get_origin(annotation) is Annotated


def _shown(path: str, field: FieldInfo) -> str:
    default = field.default
    if isinstance(default, BaseModel):
        default = PydanticUndefined
    if default in (None, PydanticUndefined, "", {}, ()):
        return by_end(path, EXAMPLES) or "null"
    return flow(default)


def flow(value: Any) -> str:
    """A value as YAML on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow(own)}" for key, own in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(flow(own) for own in value) + "]"
    if isinstance(value, bool) or value is None:
        return json.dumps(value)
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, int):
        return str(value)
    plain = str(value).replace("_", "").replace("-", "").replace(".", "").replace("/", "")
    words = ("true", "false", "yes", "no", "null", "on", "off", "y", "n")
    safe = plain.isascii() and plain.isalnum() and not plain[0].isdigit() and str(value).lower() not in words
    safe = safe and not str(value).startswith(("-", ".", "/"))
    return str(value) if safe or value == "." else json.dumps(str(value), ensure_ascii=False)

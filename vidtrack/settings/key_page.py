"""docs/configuration.md: every key of config.yaml with its meaning, default and an example, from the settings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from vidtrack.settings.commented import EXAMPLES, by_end, flow, inner_section
from vidtrack.settings.config import Settings
from vidtrack.settings.detection import DetectChange

HEAD = """# Every key of config.yaml

Made from the settings by `python -m vidtrack.settings page`; a test compares the two. `vidtrack init` writes a
config.yaml in which every key stands as a comment. Only `units` and `cameras` are required. Lengths are in `units`,
positions in the picture in px of the frame buffer, times in seconds.

A name in angle brackets stands for one that you give: a camera, a clip, a run.
"""


FORMS: dict[str, str] = {
    "units": "m",
    "cameras": "{east: {sensor: [8.8, 6.6]}, west: {}}",
    "runs": "{pluck: {targets: 2}}",
    "calibration": "{model: auto, clips: {front: {tags: 1-12}}}",
    "clips": "{front: {tags: 1-12}, rear: {tags: 13-24}}",
    "export": "[qtm, c3d]",
    "axes": "{waves: +x, up: +z}",
    "report": "{}",
    "<camera>.calibration": "{model: brown, fix: [Sx]}",
    "tracks": "{format: dltdv8}",
    "camera_file": "{path: lenses/cam1.toml}",
    "readout_ms": "16.7",
    "k1": "-0.31",
    "k2": "0.12",
    "k3": "-0.02",
    "k4": "0.004",
    "p1": "0.0004",
    "p2": "-0.0002",
    "format": "dltdv8",
    "origin": "upper-left",
    "first_pixel": "1",
    "size": "[1280, 720]",
    "likelihood": "0.6",
    "path": "lenses/cam1.toml",
    "camera_file.units": "mm",
    "sigma_px": "0.3",
    "camera_file.lens": "lenses/profile.txt",
    "detect.sd": "0.3",
    "point": "[0, 0, 0]",
    "normal": "[0, 1, 0]",
    "indices": "[1.0, 1.49, 1.333]",
    "thickness": "0.5",
    "<interface>.sigma": "{position: 0.1, tilt: 0.5}",
    "position": "0.1",
    "tilt": "0.5",
    "sigma.thickness": "0.02",
    "index": "0.001",
    "detect.start": "10:00:55:12",
    "detect.end": "300",
    "hue": "0",
    "reference": "{value: x_in, axis: x}",
    "<run>.truth": "{offset_s: 36000.0}",
    "plane": "{scale: 0.14}",
    "analysis": "decay",
    "decay": "{series: t1.x, drop_half_cycles: 2}",
    "<target>": "a: [6, 0, 0]",
    "<body>.points": "{CoG: [2, 2, 0]}",
    "<body>.tags": "{7: {centre: [0, 0, 2]}}",
    "<run>.tags": "{family: 36h11, size: 4}",
    "ids": "[7, 9]",
    "corners": "[[-2, 2, 0], [2, 2, 0], [2, -2, 0], [-2, -2, 0]]",
    "centre": "[0, 0, 2]",
    "tags.<tag>.size": "2.5",
    "tags.size": "4",
    "channels.clock": "{lamp: lamp_V}",
    "decay.start": "2.0",
    "decay.end": "30.0",
    "waves.start": "20.0",
    "waves.end": "120.0",
    "analysis.waves": "{elevation: gauge}",
    "depth": "2.5",
    "channels": "{file: channels.csv, columns: {gauge: eta_m}}",
    "lamp": "lamp_V",
    "waterline": "{transects: {profile1: {from: [0, 0, 0], to: [10, 0, 1]}}}",
    "still_water": "0.0",
    "from": "[0, 0, 0]",
    "to": "[10, 0, 1]",
    "step": "0.01",
    "profile": "beach.csv",
}
"""Examples of keys that config.yaml shows without one, by the end of their path; the longest that fits counts."""


def key_page() -> str:
    """The page as Markdown."""
    return HEAD + "".join(_section("config.yaml", Settings, ""))


def _section(title: str, model: type[BaseModel], path: str) -> Iterator[str]:
    yield f"\n## {title}\n\n{(model.__doc__ or '').strip().splitlines()[0]}\n\n"
    yield "| key | default | meaning | example |\n|---|---|---|---|\n"
    below: list[tuple[str, type[BaseModel], str]] = []
    for name, field in model.model_fields.items():
        key = field.alias or name
        if issubclass(model, DetectChange) and name in DetectChange.model_fields and model is not DetectChange:
            continue  # they stand under `detect`
        if path.endswith("<body>."):  # whose targets stand in it by their names, beside `points`
            key = {"named": "points", "targets": "<target>"}.get(key, key)
        inner, many = inner_section(field)
        here = f"{path}{key}" + (f".<{_singular(key)}>" if many else "")
        if inner is not None and inner is not DetectChange:
            below.append((here, inner, f"{here}."))
        example = _example(f"{path}{key}", key, field, inner)
        yield f"| `{path}{key}` | {_default(field)} | {_cell(_meaning(field))} | {example} |\n"
    if issubclass(model, DetectChange) and model is not DetectChange:
        yield f"\nEvery key of `detect` may stand in `{path}detect` or directly in `{path.removesuffix('.')}`.\n"
    for here, inner, deeper in below:
        yield from _section(f"`{here}`", inner, deeper)


def _singular(key: str) -> str:
    return {"bodies": "body", "columns": "channel"}.get(key, key.removesuffix("s"))


def _meaning(field: FieldInfo) -> str:
    words = _words(field.annotation)
    text = field.description or ""
    return text + (f" ({', '.join(words)})" if words and not all(word in text for word in words) else "")


def _words(annotation: Any) -> list[str]:
    if get_origin(annotation) is Literal:
        return [str(word) for word in get_args(annotation)]
    return [word for part in get_args(annotation) for word in _words(part)]


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    default = field.default
    if isinstance(default, BaseModel) or default is None or default is PydanticUndefined or default in ({}, (), ""):
        return ""
    return f"`{flow(default)}`"


def _example(path: str, key: str, field: FieldInfo, inner: type[BaseModel] | None) -> str:
    plain = inner is None and field.default not in (None, PydanticUndefined, {}, ())
    text = by_end(path, EXAMPLES) or "null"
    own = None if plain else by_end(path, FORMS)
    if own is not None and (text == "null" or key not in FORMS):
        text = own
    elif text == "null" and plain:
        text = flow(field.default)
    if text == "null":
        return ""
    return f"`{_bars(text)}`" if key == "<target>" else f"`{key}: {_bars(text)}`"


def _cell(text: str) -> str:
    return _bars(text).replace("<", "&lt;")


def _bars(text: str) -> str:
    return text.replace("|", "\\|")

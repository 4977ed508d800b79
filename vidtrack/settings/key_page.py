"""docs/configuration.md: every key of config.yaml with its meaning, default and an example, from the settings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from vidtrack.settings.commented import EXAMPLES, flow, inner_section
from vidtrack.settings.config import Settings
from vidtrack.settings.detection import DetectChange

HEAD = """# Every key of config.yaml

Made from the settings by `python -m vidtrack.settings page`; a test compares the two. `vidtrack init` writes a
config.yaml in which every key stands as a comment. Only `units` and `cameras` are required. Lengths are in `units`,
positions in the picture in px of the frame buffer, times in seconds.

A name in angle brackets stands for one that you give: a camera, a clip, a run.
"""


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
        if path.endswith(">.") and key == "named":
            key = "points"
        inner, many = inner_section(field)
        here = f"{path}{key}" + (f".<{_singular(key)}>" if many else "")
        if inner is not None and inner is not DetectChange:
            below.append((here, inner, f"{here}."))
        yield f"| `{path}{key}` | {_default(field)} | {_cell(_meaning(field))} | {_example(key, field, inner)} |\n"
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


def _example(key: str, field: FieldInfo, inner: type[BaseModel] | None) -> str:
    if key in EXAMPLES and EXAMPLES[key] != "null":
        return f"`{key}: {_bars(EXAMPLES[key])}`"
    if inner is not None or field.default in (None, PydanticUndefined, {}, ()):
        return ""
    return f"`{key}: {_bars(flow(field.default))}`"


def _cell(text: str) -> str:
    return _bars(text).replace("<", "&lt;")


def _bars(text: str) -> str:
    return text.replace("|", "\\|")

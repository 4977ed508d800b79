"""What pydantic finds wrong in a file that a person wrote, as clear lines."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel

from vidtrack.naming import did_you_mean

_BRANCHES = re.compile(r"^(function-|tuple\[|constrained-|literal\[|Clock$|WandAxes$|\[key\]|nullable)")
"""What pydantic adds to a place to say which of several allowed forms it tried."""
_PLAIN = ("float", "int", "str")
"""The same of a plain value, at the end of the place: elsewhere it is a name that a person gave, as of a body."""


def mistakes(where: str, problems: Sequence[Mapping[str, Any]], kind: type[BaseModel]) -> list[str]:
    """One line for each place that is wrong, whatever the number of forms that were tried there.

    where     the file
    problems  pydantic's errors
    kind      of what stands in the file
    """
    found: dict[str, list[str]] = {}
    for problem in problems:
        path = [str(part) for part in problem["loc"] if not _BRANCHES.match(str(part))]
        path = path[:-1] if path and path[-1] in _PLAIN else path
        if problem["type"] == "literal_error" and isinstance(problem["input"], Mapping):
            continue  # the other form of this place has reported what is wrong inside
        found.setdefault(".".join(path), []).append(_message(path, problem, kind))
    return [
        f"{where}: {place + ': ' if place else ''}{' Or: '.join(dict.fromkeys(texts))}"
        for place, texts in found.items()
    ]


def _message(path: list[str], problem: Mapping[str, Any], model: type[BaseModel]) -> str:
    kind, context, value = problem["type"], problem.get("ctx", {}), _short(problem["input"])
    if kind == "extra_forbidden":
        here = _known_keys(path[:-1], model)
        near = did_you_mean(path[-1], here) or did_you_mean(path[-1], _all_keys(model))
        if near == path[-1]:
            return f"no such setting in this section, but in another one. Move it; known here: {', '.join(here)}."
        return "no such setting; " + (f"did you mean {near!r}?" if near else f"known here: {', '.join(here)}.")
    if kind == "missing":
        return "missing. Give it; it has no default."
    if kind in ("dict_type", "model_type", "model_attributes_type"):
        return f"takes `key: value` lines, not {value}."
    if kind == "literal_error":
        near = did_you_mean(str(problem["input"]), re.findall(r"'([^']*)'", context["expected"]))
        return f"{value} is not {context['expected']}" + (f"; did you mean {near!r}?" if near else ".")
    message = str(context["error"]) if kind == "value_error" else str(problem["msg"])
    tail = "" if kind == "value_error" and isinstance(problem["input"], Mapping) else f", not {value}"
    return f"{message[0].lower()}{message[1:]}{tail}."


@cache
def _schema(model: type[BaseModel]) -> dict[str, Any]:
    """The JSON schema of what may stand in a file: it takes a tenth of a second to make."""
    return model.model_json_schema(by_alias=True)


@cache
def _all_keys(model: type[BaseModel]) -> list[str]:
    schema = _schema(model)
    parts = [schema, *schema.get("$defs", {}).values()]
    return sorted({key for part in parts for key in part.get("properties", {})})


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _known_keys(path: list[str], model: type[BaseModel]) -> list[str]:
    """The keys that are allowed at a place of the file."""
    schema: Any = _schema(model)
    definitions = schema.get("$defs", {})

    def resolved(node: Any) -> Any:
        while "$ref" in node:
            node = definitions[node["$ref"].rsplit("/", 1)[1]]
        for choice in node.get("anyOf", ()):
            inner = resolved(choice)
            if "properties" in inner or "additionalProperties" in inner:
                return inner
        return node

    node = resolved(schema)
    for part in path:
        properties = node.get("properties", {})
        node = properties.get(part, node.get("additionalProperties") or {})
        node = resolved(node) if isinstance(node, dict) else {}
    return list(node.get("properties", {}))

"""What pydantic finds wrong in a file that a person wrote, as clear lines."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel

from vidtrack.lengths import METRES, WORDS
from vidtrack.naming import did_you_mean

_BRANCHES = re.compile(r"^(function-|tuple\[|dict\[|constrained-|literal\[|Clock$|WandAxes$|\[key\]|nullable)")
"""What pydantic adds to a place to say which of several allowed forms it tried."""
_PLAIN = ("float", "int", "str")
"""The same of a plain value, at the end of the place: elsewhere it is a name that a person gave, as of a body."""

OTHER_WORDS = {"fps": "rate", "framerate": "rate", "frame_rate": "rate"}
"""What other programs call a setting."""

_FORM = re.compile(r"_type$|_parsing$|^literal_error$")
"""Errors of a value that has not the form which pydantic tried there."""


def mistakes(where: str, problems: Sequence[Mapping[str, Any]], kind: type[BaseModel]) -> list[str]:
    """One line for each place that is wrong, whatever the number of forms that were tried there.

    where     the file
    problems  pydantic's errors
    kind      of what stands in the file
    """
    found: dict[str, list[str]] = {}
    forms: dict[str, list[bool]] = {}
    for problem in problems:
        path = [str(part) for part in problem["loc"] if not _BRANCHES.match(str(part))]
        path = path[:-1] if path and path[-1] in _PLAIN else path
        if problem["type"] == "literal_error" and isinstance(problem["input"], Mapping):
            continue  # the other form of this place has reported what is wrong inside
        found.setdefault(".".join(path), []).append(_message(path, problem, kind))
        forms.setdefault(".".join(path), []).append(bool(_FORM.search(problem["type"])))
    for place, other in forms.items():
        if not all(other):  # one form fits, and its value is wrong: the others are not meant
            found[place] = [text for text, form in zip(found[place], other, strict=True) if not form]
    return [
        f"{where}: {place + ': ' if place else ''}{' Or: '.join(dict.fromkeys(texts))}"
        for place, texts in found.items()
    ]


def _message(path: list[str], problem: Mapping[str, Any], model: type[BaseModel]) -> str:
    kind, context, value = problem["type"], problem.get("ctx", {}), _short(problem["input"])
    if kind == "extra_forbidden":
        here = _known_keys(path[:-1], model)
        usual = OTHER_WORDS.get(path[-1].casefold())
        near = usual if usual in here else did_you_mean(path[-1], here) or did_you_mean(path[-1], _all_keys(model))
        if near == path[-1]:
            return f"no such setting in this section, but in another one. Move it; known here: {', '.join(here)}."
        return "no such setting; " + (f"did you mean {near!r}?" if near else f"known here: {', '.join(here)}.")
    if kind == "missing":
        return "missing. Give it; it has no default."
    if kind in ("dict_type", "model_type", "model_attributes_type"):
        return f"takes `key: value` lines, not {value}.{_as_lines(problem['input'])}"
    if kind == "invalid_key":
        return f"no setting is named {path[-1]}. Decimals begin with a point, and in braces a comma ends a setting."
    if kind == "literal_error":
        near = _near(str(problem["input"]), re.findall(r"'([^']*)'", context["expected"]))
        return f"{value} is not {context['expected']}" + (f"; did you mean {near!r}?" if near else ".")
    if kind in ("tuple_type", "list_type"):
        return f"takes a list, not {value}. {_as_list(problem['input'])}"
    if kind in ("too_long", "too_short"):
        wanted = context.get("max_length", context.get("min_length"))
        return f"{context['actual_length']} entries where {wanted} are wanted: {value}. Decimals begin with a point."
    if kind in ("float_parsing", "int_parsing"):
        return f"takes a {'whole ' * (kind == 'int_parsing')}number, not {value}. {_as_number(problem['input'])}"
    if kind == "int_from_float":
        return f"takes a whole number, not {value}."
    message = str(context["error"]) if kind == "value_error" else str(problem["msg"])
    tail = "" if kind == "value_error" and isinstance(problem["input"], Mapping) else f", not {value}"
    return f"{message[0].lower()}{message[1:]}{tail}."


def _near(word: str, allowed: Sequence[str]) -> str | None:
    """The allowed word that is meant, a unit of length by any of its words; None where it is none of these units."""
    if set(allowed) == set(METRES):
        units = [unit for unit, words in WORDS.items() if word.strip().casefold() in words]
        if not units:  # misspelt: inchs, milimeter
            from difflib import get_close_matches

            near = get_close_matches(word.strip().casefold(), [w for words in WORDS.values() for w in words], 1, 0.8)
            units = [unit for unit, words in WORDS.items() if near and near[0] in words]
        if units:
            return units[0] if units[0] in allowed else None
    return did_you_mean(word, allowed)


_NUMBER = r"[-+]?\d+(?:[.,]\d+)?"


def _as_number(given: str) -> str:
    """What to write for a text in the place of a number; only what it must mean."""
    text = given.strip()
    if re.fullmatch(r"[-+]?\d+,\d+", text):
        return f"Decimals begin with a point: {text.replace(',', '.')}."
    if parts := re.fullmatch(r"(?:(\d+)[ +-]+)?(\d+)/([1-9]\d*)", text):
        return f"Write it as a decimal: {int(parts[1] or 0) + int(parts[2]) / int(parts[3]):.6g}."
    if parts := re.fullmatch(rf"({_NUMBER})\s*([^\W\d_]+|[\"'%°])\.?", text):
        return "Write a number alone, in the unit that the documentation of this key states."
    return "Write a number."


def _as_lines(given: object) -> str:
    """What to write for a list of names in the place of a section."""
    if isinstance(given, Sequence) and not isinstance(given, str) and given and isinstance(given[0], str):
        return f" Write `{given[0]}: {{}}`, and so each of them, on a line of its own."
    return ""


def _as_list(given: object) -> str:
    """What to write for a single value in the place of a list."""
    if isinstance(given, str):
        if re.fullmatch(r"[^\W\d]\w*", given):
            return f"Write [{given}]."
        numbers = re.fullmatch(rf"\s*({_NUMBER})\s*[x×*;, ]\s*({_NUMBER})\s*", given)
        parts = numbers.groups() if numbers else [part.strip() for part in re.split("[,;]", given)]
        return (
            f"Write [{', '.join(part.replace(',', '.') for part in parts)}]." if len(parts) > 1 else "Write [..., ...]."
        )
    return "Write [..., ...]."


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

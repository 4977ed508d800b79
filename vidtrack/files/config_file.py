"""config.yaml as a person wrote it: syntax errors with their line, repeated keys refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import yaml

from vidtrack.errors import VidtrackError
from vidtrack.files.beside import is_pipe

LARGEST = 200_000
"""Values in a config."""


def read_config(path: str, needed: str = "`units` and `cameras`") -> dict[str, Any]:
    """The parsed config; VidtrackError with the line for a missing file, bad YAML or a key given twice.

    needed   what must stand in it, for messages
    """
    if is_pipe(path):
        raise VidtrackError(f"{path}: no file but a pipe or a device. Put the file itself there.")
    try:
        with open(path, encoding="utf-8-sig") as file:
            text = file.read()
    except FileNotFoundError:
        raise VidtrackError(
            f"{path}: no such file in this folder. Write one ({needed} are required), "
            "or name the experiment's folder with --directory."
        ) from None
    except OSError as error:
        raise VidtrackError(f"{path}: cannot be read ({error.strerror}). Correct its permissions.") from None
    except UnicodeDecodeError as error:
        raise VidtrackError(f"{path}: not a text file in UTF-8 (byte {error.start}). Save it as UTF-8.") from None
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"\s*tags:\s*#[\w-]", line):
            raise VidtrackError(
                f"{path}, line {number}: # begins a comment, so that no tags are left. Put the tags in quotes."
            )
    try:
        config = yaml.load(text, _StrictLoader)
        size = _size(config)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{path}, line {mark.line + 1}, column {mark.column + 1}" if mark else path
        if mark and (close := _without_space(text.splitlines()[: mark.line + 1])):
            number, key = close
            raise VidtrackError(f"{path}, line {number}: no space follows the colon. Write `{key}: ...`.") from None
        if mark and (odd := _odd_space(text.splitlines()[: mark.line + 1])):
            raise VidtrackError(f"{path}, {odd}") from None
        raise VidtrackError(f"{where}: not valid YAML: {error.problem or error.context}. Correct that line.") from None
    except RecursionError:
        raise VidtrackError(
            f"{path}: nested too deep to be settings. Correct the brackets or the indentation."
        ) from None
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, OverflowError) as error:
        problem = " ".join(str(error).split())[:200]
        raise VidtrackError(f"{path}: not valid YAML: {problem}. Correct the file.") from None
    if size > LARGEST:
        raise VidtrackError(f"{path}: its aliases (*) stand for more than {LARGEST} values. Write the settings out.")
    if config is None:
        raise VidtrackError(f"{path}: empty. Write at least {needed}.")
    if not isinstance(config, dict):
        raise VidtrackError(f"{path}: holds no settings, but {str(config)[:40]!r}. Write `key: value` lines.")
    return config


def _without_space(lines: Sequence[str]) -> tuple[int, str] | None:
    """The last line, and its key, that ends a key with a colon and goes on without a space; None where none does."""
    for number in range(len(lines), 0, -1):
        if found := re.match(r"\s*([A-Za-z]\w*):[^\s:/\\]", lines[number - 1]):
            return number, found[1]
    return None


def _odd_space(lines: Sequence[str]) -> str | None:
    """Which of the last two lines has a tab or another space in the place of a space, and what to do; None without."""
    for number in range(len(lines), max(len(lines) - 2, 0), -1):
        plain = lines[number - 1].split(" #")[0]
        if found := re.search(r"[^\S \r\n]", plain):
            kind = "a tab" if found[0] == "\t" else f"a space of another kind (U+{ord(found[0]):04X})"
            return f"line {number}, column {found.start() + 1}: {kind} stands there. Write plain spaces in its place."
    return None


def _size(value: object, within: int = 0) -> int:
    """Values in a config, those that aliases repeat counted each time, as far as `LARGEST`."""
    if not isinstance(value, (dict, list)):
        return within + 1
    for part in value.values() if isinstance(value, dict) else value:
        within = _size(part, within)
        if within > LARGEST:
            break
    return within + 1


class _StrictLoader(yaml.SafeLoader):
    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: dict[Any, int] = {}
        for key_node, _ in node.value:
            if key_node.tag == "tag:yaml.org,2002:merge":
                continue
            key = self.construct_object(key_node, deep=True)
            plain = type(key) is str or (type(key) is int and str(key) == key_node.value)
            if isinstance(key_node, yaml.ScalarNode) and not plain:
                raise yaml.MarkedYAMLError(
                    problem=f"{key_node.value} means {key!r} in YAML; put it in quotes: '{key_node.value}'",
                    problem_mark=key_node.start_mark,
                )
            if isinstance(key, (str, int, float)) and key in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key!r} appears twice (also line {seen[key]})", problem_mark=key_node.start_mark
                )
            if isinstance(key, (str, int, float)):
                seen[key] = key_node.start_mark.line + 1
        return super().construct_mapping(node, deep)

    def construct_number(self, node: yaml.ScalarNode) -> int | float:
        """YAML 1.1 counts 10:00:00:10 in sixties: the number 2160010, where a time code was meant."""
        make = self.construct_yaml_int if node.tag.endswith(":int") else self.construct_yaml_float
        value: int | float = make(node)
        if node.tag.endswith(":int") and re.fullmatch(r"0\d+", node.value):
            raise yaml.MarkedYAMLError(
                problem=f"{node.value} means the number {value} in YAML; put it in quotes: '{node.value}'",
                problem_mark=node.start_mark,
            )
        if ":" in node.value:
            raise yaml.MarkedYAMLError(
                problem=f"{node.value} means the number {value} in YAML; put it in quotes: '{node.value}'",
                problem_mark=node.start_mark,
            )
        return value


_StrictLoader.add_constructor("tag:yaml.org,2002:int", _StrictLoader.construct_number)
_StrictLoader.add_constructor("tag:yaml.org,2002:float", _StrictLoader.construct_number)

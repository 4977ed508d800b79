"""The end of a page: with which settings, files and programs its numbers were made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from vidtrack.report.explanations import ABOUT
from vidtrack.report.page import Section, Table

Record = Mapping[str, Any]

HIDDEN = ("run", "runs", "camera", "units", "title", "cameras", "results", "asked")
"""Settings that the page says elsewhere."""

LONGEST = 120


def provenance_section(records: Iterable[tuple[str, Record | None]], units: str) -> Section | None:
    """The section; records: of what (a camera, or the whole), and a record that has `provenance`."""
    settings: dict[tuple[str, str, str], list[str]] = {}
    files: dict[str, str] = {}
    programs: dict[tuple[str, str], None] = {}
    for about, record in records:
        made: Record = (record or {}).get("provenance") or {}
        if not made:
            continue
        for key, value in _flat(made.get("settings") or {}):
            settings.setdefault((str(made.get("rule")), key, value), []).append(about)
        files |= {path: checksum for path, checksum in (made.get("inputs") or {}).items() if not _ours(path)}
        program = {"vidtrack": made.get("vidtrack"), "commit": made.get("commit"), **(made.get("libraries") or {})}
        programs |= dict.fromkeys((name, str(version)) for name, version in program.items() if version)
    if not settings and not files and not programs:
        return None
    tables = [
        Table(
            f"Settings; the unit of length is {units}",
            ["step", "setting", "value", "of"],
            [[rule, key, value, _joined(of)] for (rule, key, value), of in settings.items()],
            ABOUT["provenance"],
        ),
        Table(
            "Files that people recorded and wrote",
            ["file", "SHA-256"],
            [[path, checksum] for path, checksum in sorted(files.items())],
            ABOUT["provenance"],
        ),
        Table("Programs", ["program", "version"], [list(pair) for pair in programs], ABOUT["provenance"]),
    ]
    return Section("provenance", "Settings and provenance", tables=[table for table in tables if table.rows])


def _flat(value: Any, path: str = "") -> Iterable[tuple[str, str]]:
    """Each setting by its path, such as detect.threshold; what is not set is left out."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if path or key not in HIDDEN:
                yield from _flat(inner, f"{path}.{key}" if path else str(key))
    elif value is not None:
        text = ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
        if text:
            yield path, text if len(text) <= LONGEST else f"{text[: LONGEST - 2]} …"


def _ours(path: str) -> bool:
    """Whether a file is a result of another step, which has its own provenance."""
    return path.startswith("results/")


def _joined(names: list[str]) -> str:
    return ", ".join(dict.fromkeys(name for name in names if name)) or "all"

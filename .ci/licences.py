"""The licences of the packages in requirements.lock, as they are installed: a table, and which may not be used.

    python .ci/licences.py requirements.lock release/licences.csv

A package may be used where each part of its licence is among ALLOWED, or one of several that it offers is: licences
that let a program of any licence use the package as it is. Exit code 1 and a line each for any other, and for those
whose licence is not found. Packages that are locked for other systems are not installed here: see ELSEWHERE.
"""

from __future__ import annotations

import csv
import importlib.metadata
import re
import sys
from collections.abc import Iterable
from pathlib import Path

ALLOWED = {
    "0BSD",
    "Apache-2.0",
    "BSD",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "CC0-1.0",
    "LGPL-3.0-only",
    "MIT",
    "MIT-CMU",
    "MPL-2.0",
    "PSF-2.0",
    "Public Domain",
    "Zlib",
}

NAMES = {
    "Apache Software License": "Apache-2.0",
    "Apache License 2.0": "Apache-2.0",
    "BSD License": "BSD",
    "GNU General Public License (GPL)": "GPL",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}
"""Classifiers and common spellings, by the names of SPDX."""

TEXTS = {
    "MIT": "Permission is hereby granted, free of charge, to any person obtaining a copy",
    "BSD": "Redistribution and use in source and binary forms",
    "Apache-2.0": "Apache License",
}
"""What stands in the text of a licence and in no other of these."""

ELSEWHERE = {"colorama": "BSD-3-Clause", "pyreadline3": "BSD"}
"""Packages that only Windows needs."""

OPTIONAL = ("npTDMS",)
"""What an extra brings: listed where it is installed."""


def licence_of(package: importlib.metadata.Distribution) -> str:
    """What a package states, as an SPDX expression: its field, else its classifiers, else the text that it ships."""
    about = package.metadata
    if stated := about.get("License-Expression"):
        return stated
    classifiers = [c.split(" :: ")[-1] for c in about.get_all("Classifier") or [] if c.startswith("License :: ")]
    if kinds := [kind for kind in classifiers if kind != "OSI Approved"]:
        return " OR ".join(NAMES.get(kind, kind) for kind in kinds)
    line = (about.get("License") or "").strip().split("\n")[0]
    if line:
        return NAMES.get(line, line)
    texts = [str(f.locate()) for f in package.files or () if re.search(r"licen[cs]e|copying", f.name, re.IGNORECASE)]
    for path in texts:
        text = " ".join(Path(path).read_text(encoding="utf-8", errors="replace").split())
        for name, phrase in TEXTS.items():
            if phrase in text:
                return name
    return ""


def is_allowed(expression: str) -> bool:
    """Whether a licence, an expression of SPDX with AND and OR but no exceptions, lets vidtrack use the package."""
    plain = expression.replace("(", " ").replace(")", " ")
    if re.search(r"\bAND\b", plain) and re.search(r"\bOR\b", plain):  # whatever the brackets say
        return all(part.strip() in ALLOWED for part in re.split(r"\b(?:AND|OR)\b", plain))
    if re.search(r"\bAND\b", plain):
        return all(part.strip() in ALLOWED for part in re.split(r"\bAND\b", plain))
    return any(part.strip() in ALLOWED for part in re.split(r"\bOR\b", plain))


def locked(text: str) -> list[tuple[str, str]]:
    """The packages of a lock file with their versions; one that has several versions, by Python, with each."""
    return sorted(set(re.findall(r"^([\w.-]+)==([^\s\\;]+)", text, re.MULTILINE)))


def table(packages: Iterable[tuple[str, str]]) -> list[tuple[str, str, str]]:
    """Package, version, licence; an empty licence where none was found."""
    rows = []
    for name, version in packages:
        try:
            own = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            rows.append((name, version, ELSEWHERE.get(name, "")))
        else:
            rows.append((name, version, licence_of(own)))
    return rows


def problems(rows: Iterable[tuple[str, str, str]]) -> list[str]:
    """A line for each package that may not be used, or whose licence is not known."""
    lines = []
    for name, version, licence in rows:
        if not licence:
            lines.append(
                f"{name} {version}: no licence found. Look at it, and add it to .ci/licences.py or leave it out."
            )
        elif not is_allowed(licence):
            lines.append(f"{name} {version}: {licence} is not among the licences that vidtrack may use.")
    return lines


def main(lock: str, out: str) -> int:
    rows = table(locked(Path(lock).read_text()))
    installed = {p.metadata["Name"] for p in importlib.metadata.distributions()}
    rows += table((name, importlib.metadata.version(name)) for name in OPTIONAL if name in installed)
    with open(out, "w", newline="") as file:
        csv.writer(file).writerows([("package", "version", "licence"), *rows])
    for line in (found := problems(rows)):
        print(f"release-check: {line}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))

"""What a rule's code and inputs amount to, so that only what changed runs again.

A module counts with all it imports inside the package, comments and docstrings left out: mending a comment
reruns nothing, mending a kernel reruns just the rules that use it.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import sys
from typing import Any

from vidtrack.files.atomic import replacing

PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


class Fingerprints:
    """What modules do, as hashes; what is known of a source file holds until the file changes.

    store   where it is remembered from call to call; None: nowhere
    """

    def __init__(self, store: str | None = None) -> None:
        self.store = store
        self._known: dict[str, list[Any]] = _remembered(store)
        self._changed = False

    def of(self, module: str) -> str:
        """A hash of what `module` (such as vidtrack.jobs.track) and all that it reaches inside the package do."""
        reached: dict[str, str] = {}
        waiting = [module]
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached[name], imports = self._parsed(name)
                waiting += imports
        digest = hashlib.sha256()
        for name in sorted(reached):
            digest.update(f"{name}\0{reached[name]}\0".encode())
        return digest.hexdigest()[:16]

    def save(self) -> None:
        """Remember what was found out."""
        if self.store and self._changed:
            with replacing(self.store) as file:
                file.write(json.dumps(self._known, sort_keys=True, indent=0).encode())

    def _parsed(self, module: str) -> tuple[str, list[str]]:
        """A module's code without comments and docstrings, hashed, and the package's modules that it imports."""
        source = _source(module) or ""
        state = os.stat(source)
        signature = [source, sys.version, state.st_size, state.st_mtime_ns]
        known = self._known.get(module)
        if not known or known[0] != signature:
            known = self._known[module] = [signature, *_parsed(source)]
            self._changed = True
        return known[1], known[2]


def _remembered(store: str | None) -> dict[str, Any]:
    try:
        with open(store or "", encoding="utf-8") as file:
            return dict(json.load(file))
    except (OSError, ValueError):
        return {}


def _parsed(source: str) -> tuple[str, list[str]]:
    with open(source, encoding="utf-8") as file:
        tree = ast.parse(file.read())
    imports: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            imports.add(node.module)
            imports.update(f"{node.module}.{alias.name}" for alias in node.names)
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [s for s in body if not _is_remark(s)] or [ast.Pass()]  # type: ignore[attr-defined]
    inside = sorted(name for name in imports if name.split(".")[0] == "vidtrack" and _source(name))
    return hashlib.sha256(ast.unparse(tree).encode()).hexdigest(), inside


def _is_remark(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _source(module: str) -> str | None:
    path = os.path.join(PACKAGE, *module.split(".")[1:])
    for candidate in (path + ".py", os.path.join(path, "__init__.py")):
        if os.path.isfile(candidate):
            return candidate
    return None


class Checksums:
    """SHA-256 of files, computed once for each state (size, time of change) that a file has been in.

    store   where they are remembered from call to call
    """

    def __init__(self, store: str) -> None:
        self.store = store
        self._changed = False
        self._known: dict[str, list[str | int]] = _remembered(store)

    def knows(self, path: str) -> bool:
        """Whether the file's checksum is remembered for the state that the file is in."""
        state = os.stat(path)
        return self._known.get(path, [])[:2] == [state.st_size, state.st_mtime_ns]

    def of(self, path: str) -> str:
        """The checksum of the file's content; OSError where it cannot be read."""
        if self.knows(path):
            return str(self._known[path][2])
        state = os.stat(path)
        with open(path, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        self._known[path] = [state.st_size, state.st_mtime_ns, digest]
        self._changed = True
        return digest

    def save(self) -> None:
        """Remember what was computed."""
        if self._changed:
            with replacing(self.store) as file:
                file.write(json.dumps(self._known, sort_keys=True, indent=0).encode())

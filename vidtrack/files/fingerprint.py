"""What a rule's code and inputs amount to, so that only what changed runs again.

A module counts with all it imports inside the package, comments and docstrings left out: mending a comment
reruns nothing, mending a kernel reruns just the rules that use it.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
from functools import cache

from vidtrack.files.atomic import replacing

PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def code_fingerprint(module: str) -> str:
    """A hash of what `module` (such as vidtrack.jobs.track) and every module that it reaches inside the package do."""
    reached: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += _parsed(name)[1]
    digest = hashlib.sha256()
    for name in sorted(reached):
        digest.update(f"{name}\0{_parsed(name)[0]}\0".encode())
    return digest.hexdigest()[:16]


@cache
def _parsed(module: str) -> tuple[str, tuple[str, ...]]:
    """A module's code without comments and docstrings, hashed, and the package's modules that it imports."""
    with open(_source(module) or "", encoding="utf-8") as file:
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
    inside = tuple(sorted(name for name in imports if name.split(".")[0] == "vidtrack" and _source(name)))
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
        try:
            with open(store, encoding="utf-8") as file:
                self._known: dict[str, list[str | int]] = json.load(file)
        except (OSError, ValueError):
            self._known = {}

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

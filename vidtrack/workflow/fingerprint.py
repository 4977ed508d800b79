"""What a rule's code amounts to, and what files hold, as hashes: only what changed runs again.

A module counts with all it imports inside the package and with the files that lie beside them (templates), comments and
docstrings left out: an edited comment reruns nothing, an edited kernel reruns just the rules that use it.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import sys
from contextlib import suppress
from typing import Any

from vidtrack.files.atomic import replacing
from vidtrack.progress import Progress, announce_end

PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

LIBRARIES = {"av": "av", "cv2": "opencv-python-headless", "numpy": "numpy", "scipy": "scipy"}
"""Libraries whose version may move a number: the name that is imported, and the package that brings it."""


REMEMBERED = os.path.join(".snakemake", "vidtrack", "checksums.json")
"""Where checksums are kept, from the folder in which Snakemake works."""


def beside_the_code() -> str:
    """Where what is known of the package's sources is kept for all folders, as Python keeps compiled code."""
    return os.path.join(PACKAGE, "__pycache__", "fingerprints.json")


class Fingerprints:
    """What modules do, as hashes; what is known of a source file holds until the file changes.

    store   where it is kept from call to call, beside `beside_the_code`; None: nowhere, and nothing is looked up
    """

    def __init__(self, store: str | None = None) -> None:
        self.store = store
        self._known: dict[str, list[Any]] = _remembered(store, 4)
        self._beside: dict[str, list[Any]] = _remembered(store and beside_the_code(), 4)
        self._changed = False

    def of(self, *modules: str) -> str:
        """A hash of what `modules` (such as vidtrack.jobs.track) and all that they reach inside the package do."""
        digest = hashlib.sha256()
        for name, content in sorted(self._reached(modules)[0].items()):
            digest.update(f"{name}\0{content}\0".encode())
        return digest.hexdigest()[:16]

    def libraries(self, *modules: str) -> list[str]:
        """Which of LIBRARIES the modules, and all that they reach inside the package, import."""
        return sorted(self._reached(modules)[1])

    def save(self) -> None:
        """Save what was computed."""
        if not self.store or not self._changed:
            return
        _remember(self.store, self._known)
        with suppress(OSError):  # a package that another user installed
            _remember(beside_the_code(), self._beside | self._known)

    def _reached(self, modules: tuple[str, ...]) -> tuple[dict[str, str], set[str]]:
        """Name: hash of every module and data file that is reached, and the libraries that they import."""
        reached: dict[str, str] = {}
        libraries: set[str] = set()
        rooms: set[str] = set()
        waiting = list(modules)
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached[name], imports, others = self._parsed(name)
                waiting += imports
                libraries.update(others)
                rooms.add(os.path.dirname(_source(name) or ""))
        for room in rooms:
            reached |= {os.path.relpath(path, PACKAGE): self._data(path) for path in _data_files(room)}
        return reached, libraries

    def _parsed(self, module: str) -> tuple[str, list[str], list[str]]:
        """A module's code without comments and docstrings, hashed; what it imports of the package, and of LIBRARIES."""
        source = _source(module) or ""
        code, imports, libraries = self._recall(module, source, _parsed)
        return code, imports, libraries

    def _data(self, path: str) -> str:
        return str(self._recall(path, path, lambda path: (_digest(path), [], []))[0])

    def _recall(self, name: str, path: str, compute: Any) -> Any:
        signature = [path, sys.version, *state_of(path)]
        known = self._known.get(name)
        if not known or known[0] != signature:
            known = self._beside.get(name)
            if not known or known[0] != signature:
                known = [signature, *compute(path)]
            self._known[name] = known
            self._changed = True
        return tuple(known[1:])


def state_of(path: str) -> list[int]:
    """What shows, without reading it, that a file is another one or was written to: size, times of change, inode."""
    state = os.stat(path)
    return [state.st_size, state.st_mtime_ns, state.st_ctime_ns, state.st_ino]


AsItIs = tuple[str, ...]
"""A path, and what shows that another file is there now, or the same one written to."""


def as_it_is(path: str) -> AsItIs:
    """By this what was read of a file may be kept in a process that does one job after another."""
    return path, os.path.abspath(path), *map(str, state_of(path))


LONG = 256 << 20
"""Bytes from which on progress is shown while a file is read: a second of a hard disc, or two."""


def _digest(path: str) -> str:
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size < LONG:
            return hashlib.file_digest(file, "sha256").hexdigest()
        digest = hashlib.sha256()
        with Progress(f"checksum of {os.path.basename(path)}", size >> 20, "MB") as progress:
            while piece := file.read(1 << 23):
                digest.update(piece)
                progress.advance(len(piece) >> 20)
        announce_end()
        return digest.hexdigest()


def _remember(store: str, known: dict[str, list[Any]]) -> None:
    """Write entries with their own checksum, so that a damaged store is known for one."""
    text = json.dumps(known, sort_keys=True, indent=0)
    with replacing(store) as file:
        file.write(f"{hashlib.sha256(text.encode()).hexdigest()}\n{text}".encode())


def _remembered(store: str | None, length: int) -> dict[str, Any]:
    """The store's entries; none where it cannot be read, or is not as it was written."""
    try:
        with open(store or "", encoding="utf-8") as file:
            checksum, _, text = file.read().partition("\n")
        if checksum != hashlib.sha256(text.encode()).hexdigest():
            return {}
        known = json.loads(text)
    except (OSError, ValueError):
        return {}
    return {name: entry for name, entry in known.items() if len(entry) == length}


def _parsed(source: str) -> tuple[str, list[str], list[str]]:
    with open(source, encoding="utf-8") as file:
        tree = ast.parse(file.read())
    written: list[str] = []
    imports: set[str] = set()
    _write(tree, written, imports)
    inside = sorted(name for name in imports if name.split(".")[0] == "vidtrack" and _source(name))
    libraries = sorted({name.split(".")[0] for name in imports} & set(LIBRARIES))
    return hashlib.sha256("\0".join(written).encode(errors="surrogatepass")).hexdigest(), inside, libraries


def _write(node: ast.AST, to: list[str], imports: set[str]) -> None:
    """Append what a syntax tree says, without remarks and places, and gather what it imports.

    What is empty is left out, for newer Pythons add fields. One walk: the first plan of a folder waits for it.
    """
    if isinstance(node, ast.Import):
        imports.update(alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
        imports.add(node.module)
        imports.update(f"{node.module}.{alias.name}" for alias in node.names)
    to.append(type(node).__name__)
    for field in node._fields:
        value = getattr(node, field, None)
        if value == [] or (value is None and not isinstance(node, ast.Constant)):
            continue
        to.append(field)
        if isinstance(value, ast.AST):
            _write(value, to, imports)
        elif isinstance(value, list):
            for item in value:
                if isinstance(item, ast.AST):
                    if not (isinstance(item, ast.Expr) and _is_remark(item)):
                        _write(item, to, imports)
                else:
                    to.append(repr(item))
            to.append("]")
        else:
            to.append(repr(value))
    to.append(")")


def _is_remark(statement: ast.Expr) -> bool:
    return isinstance(statement.value, ast.Constant) and isinstance(statement.value.value, str)


def _source(module: str) -> str | None:
    path = os.path.join(PACKAGE, *module.split(".")[1:])
    for candidate in (path + ".py", os.path.join(path, "__init__.py")):
        if os.path.isfile(candidate):
            return candidate
    return None


def _data_files(room: str) -> list[str]:
    """Files beside a room's modules that are no modules, those in folders that are no packages too."""
    found = []
    for entry in os.scandir(room):
        if entry.name.startswith(".") or entry.name in ("__pycache__", "py.typed") or entry.name.endswith("~"):
            continue
        if entry.is_dir():
            if not os.path.isfile(os.path.join(entry.path, "__init__.py")):
                found += _data_files(entry.path)
        elif not entry.name.endswith((".py", ".pyc")):
            found.append(entry.path)
    return found


class Checksums:
    """SHA-256 of files, computed once for each state (see `state_of`) that a file has been in.

    store   where they are kept from call to call
    """

    def __init__(self, store: str) -> None:
        self.store = store
        self._changed = False
        self._known: dict[str, list[Any]] = _remembered(store, 2)

    def knows(self, path: str) -> bool:
        """Whether the file's checksum is kept for the state that the file is in."""
        return path in self._known and self._known[path][0] == state_of(path)

    def of(self, path: str) -> str:
        """The checksum of the file's content; OSError where it cannot be read."""
        if self.knows(path):
            return str(self._known[path][1])
        state = state_of(path)  # taken before it is read: a file that changes meanwhile is read again next time
        digest = _digest(path)
        self._known[path] = [state, digest]
        self._changed = True
        return digest

    def save(self) -> None:
        """Save what was computed."""
        if self._changed:
            _remember(self.store, self._known)

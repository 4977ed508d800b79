"""Mutation testing: does a small error in a module make its tests fail?

    bash setup.sh mutate geometry calibration/tsai --seed 1 --count 60
    bash setup.sh mutate tracking/centroiding --count 0 --wide

A target is a room or a module. Mutants are drawn at random, by seed, among all that the operators make (`--count 0`:
all of them); each runs until the first failure against the mirror test of its module, tests/<room>/test_<module>.py
(tests/mirrors.py).
With `--wide` a survivor meets all tests of its room.

The operators are those of cosmic-ray and some of our own for array code (`mutation_operators.py`). Its runner is not
used: it writes every mutant into the source tree and starts Python anew for each, which costs more than the tests.
Here the libraries are loaded once, and each mutant is imported from memory by a forked process.

Printed: every survivor with file, line and change; then, for each module, mutants made, tried and killed.
"""

from __future__ import annotations

import argparse
import importlib.abc
import importlib.util
import os
import random
import resource
import sys
import time
from collections.abc import Iterator
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import NamedTuple

import hypothesis
import numpy  # noqa: F401  loaded before the forks, for all of them
import pytest
import scipy.optimize  # noqa: F401

from benchmarks.mutation_operators import Mutant, change, mutants, text_of
from tests.mirrors import mirror_of

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "vidtrack"
NEVER_IMPORTED = 99


class Verdict(NamedTuple):
    mutant: Mutant
    killed_by: str  # "mirror", "room" or "" for a survivor


class MutatedLoader(SourceFileLoader):
    """Loads a module from a text in memory, under the name and place of its file."""

    def __init__(self, name: str, path: str, text: str) -> None:
        super().__init__(name, path)
        self.text = text
        self.loaded = False

    def get_code(self, fullname: str) -> CodeType:
        self.loaded = True
        return compile(self.text, self.path, "exec", dont_inherit=True)


class Finder(importlib.abc.MetaPathFinder):
    def __init__(self, loader: MutatedLoader) -> None:
        self.loader = loader

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        if fullname != self.loader.name:
            return None
        return importlib.util.spec_from_file_location(fullname, self.loader.path, loader=self.loader)


def modules_of(target: str) -> list[Path]:
    """The modules of a room (`geometry`, `tracking/centroiding`) or one module, with or without vidtrack/ and .py."""
    place = PACKAGE / target.removeprefix("vidtrack/").removesuffix(".py")
    if place.is_dir():
        return sorted(p for p in place.rglob("*.py") if p.name not in ("__init__.py", "__main__.py"))
    module = place.with_suffix(".py")
    if not module.is_file():
        raise SystemExit(f"mutation: no room or module '{target}' in vidtrack")
    return [module]


def start(module: Path, text: str, tests: list[Path], seconds: float) -> int:
    """A forked process that runs `tests` with `module` replaced by `text`; its id."""
    child = os.fork()
    if child:
        return child
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    name = ".".join(module.relative_to(ROOT).with_suffix("").parts)
    loader = MutatedLoader(name, str(module), text)
    sys.meta_path.insert(0, Finder(loader))
    code = 3
    try:
        code = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *map(str, tests)]))
        code = code if loader.loaded else NEVER_IMPORTED
    finally:
        os._exit(code)


def finished(child: int, limit: float) -> int:
    """The exit code of a child; it is ended after `limit` seconds (a mutant that waits uses no processor)."""
    end = time.monotonic() + limit
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > end:
            os.kill(child, 9)
        time.sleep(0.02)


def baseline(module: Path, tests: list[Path]) -> float:
    """Seconds of processor that the tests take with the module as it is; they must pass and import it."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code = finished(start(module, module.read_text(), tests, 600), 1200)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if code == NEVER_IMPORTED:
        raise SystemExit(f"mutation: {tests[0].relative_to(ROOT)} never imports {module.relative_to(ROOT)}")
    if code:
        raise SystemExit(f"mutation: {tests[0].relative_to(ROOT)} fails without any mutation (exit code {code})")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def verdicts(chosen: list[Mutant], wide: bool) -> Iterator[Verdict]:
    takes: dict[Path, float] = {}
    for mutant in chosen:
        tests = [mirror_of(mutant.module.relative_to(PACKAGE))]
        if mutant.module not in takes:
            takes[mutant.module] = baseline(mutant.module, tests)
        seconds = 10 + 5 * takes[mutant.module]
        text = text_of(mutant)
        if finished(start(mutant.module, text, tests, seconds), 20 * seconds):
            yield Verdict(mutant, "mirror")
            continue
        room = [tests[0].parent]
        killed = wide and finished(start(mutant.module, text, room, 600), 1200) != 0
        yield Verdict(mutant, "room" if killed else "")


def table(made: list[Mutant], results: list[Verdict]) -> str:
    lines = [f"{'module':48} {'made':>6} {'tried':>6} {'killed':>7} {'share':>7}"]
    for module in [*sorted({v.mutant.module for v in results}), None]:
        of_it = [v for v in results if module in (None, v.mutant.module)]
        killed = sum(v.killed_by != "" for v in of_it)
        count = sum(module in (None, m.module) for m in made)
        name = str(module.relative_to(PACKAGE)) if module else "all"
        lines.append(f"{name:48} {count:6} {len(of_it):6} {killed:7} {killed / len(of_it):7.1%}")
    if by_room := sum(v.killed_by == "room" for v in results):
        lines.append(f"{by_room} of the killed by other tests of the room than the mirror")
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="setup.sh mutate", description=__doc__.splitlines()[0])
    parser.add_argument("targets", nargs="+", metavar="ROOM_OR_MODULE")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=100, help="mutants to try; 0 tries all (default 100)")
    parser.add_argument("--wide", action="store_true", help="try survivors on all tests of the room, too")
    options = parser.parse_args(arguments)

    modules = [module for target in options.targets for module in modules_of(target)]
    if without := [str(m.relative_to(ROOT)) for m in modules if not mirror_of(m.relative_to(PACKAGE)).exists()]:
        raise SystemExit(f"mutation: no mirror test for {', '.join(without)}")
    os.chdir(ROOT)
    hypothesis.settings.register_profile("mutation", database=None, derandomize=True, deadline=None)
    hypothesis.settings.load_profile("mutation")
    made = [mutant for module in modules for mutant in mutants(module)]
    if not made:
        raise SystemExit("mutation: nothing to mutate there")
    chosen = made
    if 0 < options.count < len(made):
        chosen = sorted(random.Random(options.seed).sample(made, options.count))
    results = []
    for verdict in verdicts(chosen, options.wide):
        results.append(verdict)
        if not verdict.killed_by:
            m = verdict.mutant
            before, after = change(m)
            print(f"survived {m.module.relative_to(ROOT)}:{m.line} {m.operator}\n  - {before}\n  + {after}", flush=True)
    print(f"\nseed {options.seed}, count {options.count}\n{table(made, results)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""From a rule's command line to its job, and from a mishap to one line and exit code 1."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from collections.abc import Sequence

from vidtrack.errors import VidtrackError
from vidtrack.job import Job


def main(argv: Sequence[str]) -> int:
    """Run one job; 0 when its outputs stand, 1 when a problem was told."""
    arguments = _parser().parse_args(argv)
    try:
        job = _job(arguments)
        importlib.import_module(f"vidtrack.jobs.{arguments.rule}").run(job)
    except VidtrackError as error:
        _tell([f"vidtrack: {problem}" for problem in error.problems], arguments.log)
        return 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _tell([f"vidtrack: {where}{error.strerror or error}. Mend it and run again."], arguments.log)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m vidtrack", description="Run one rule of the workflow.")
    parser.add_argument("rule", help="the rule's name")
    parser.add_argument("--settings", required=True, help="the rule's settings, a JSON file")
    parser.add_argument("--input", nargs="*", default=[], metavar="NAME=PATH", help="a name may come several times")
    parser.add_argument("--output", nargs="*", default=[], metavar="NAME=PATH")
    parser.add_argument("--log", help="where a problem is also written")
    parser.add_argument("--threads", type=int, default=1)
    return parser


def _job(arguments: argparse.Namespace) -> Job:
    with open(arguments.settings, encoding="utf-8") as file:
        order = json.load(file)
    inputs: dict[str, list[str]] = {}
    for pair in arguments.input:
        name, _, path = pair.partition("=")
        inputs.setdefault(name, []).append(path)
    outputs = dict(pair.split("=", 1) for pair in arguments.output)
    settings = order["settings"]
    return Job(
        settings=settings,
        inputs={name: paths[0] if len(paths) == 1 else paths for name, paths in inputs.items()},
        outputs=outputs,
        provenance={"vidtrack": _version(), "rule": arguments.rule, "settings": settings, "inputs": order["inputs"]},
        threads=arguments.threads,
    )


def _version() -> str:
    from importlib.metadata import version

    return version("vidtrack")


def _tell(lines: list[str], log: str | None) -> None:
    text = "\n".join(lines) + "\n"
    sys.stderr.write(text)
    if log:
        os.makedirs(os.path.dirname(log) or ".", exist_ok=True)
        with open(log, "w", encoding="utf-8") as file:
            file.write(text)

"""From a rule's command line to its job, and from a mishap to one line and exit code 1."""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import os
import sys
from collections.abc import Sequence

from vidtrack.errors import VidtrackError
from vidtrack.workflow.job import Job


def main(argv: Sequence[str]) -> int:
    """Run one job; 0 when its outputs stand, 1 when a problem was told, 130 when someone pressed Ctrl-C."""
    arguments = _parser().parse_args(argv)
    if arguments.log and os.path.exists(arguments.log):
        os.unlink(arguments.log)
    try:
        job = _job(arguments)
        importlib.import_module(f"vidtrack.jobs.{arguments.rule}").run(job)
    except VidtrackError as error:
        _tell([f"vidtrack: {problem}" for problem in error.problems], arguments.log)
        return 1
    except OSError as error:
        # a disk that is full names no file
        where = ", ".join([error.filename] if error.filename else [path for _, path in arguments.output])
        where += ": " if where else ""
        _tell([f"vidtrack: {where}{error.strerror or error}. Mend it and run again."], arguments.log)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m vidtrack", description="Run one rule of the workflow.")
    parser.add_argument("rule", help="the rule's name")
    parser.add_argument("--settings", required=True, help="the rule's settings, a JSON file")
    parser.add_argument(
        "--input", nargs="+", action="append", default=[], metavar=("NAME", "PATH"), help="NAME PATH ..."
    )
    parser.add_argument("--output", nargs=2, action="append", default=[], metavar=("NAME", "PATH"))
    parser.add_argument("--log", help="where a problem is also written")
    parser.add_argument("--threads", type=int, default=1)
    return parser


def _job(arguments: argparse.Namespace) -> Job:
    with open(arguments.settings, encoding="utf-8") as file:
        order = json.load(file)
    inputs = {name: paths[0] if len(paths) == 1 else paths for name, *paths in arguments.input if paths}
    settings = order["settings"]
    checksums = {**order["inputs"], **_derived(inputs, order["inputs"])}
    return Job(
        settings=settings,
        inputs=inputs,
        outputs=dict(arguments.output),
        provenance={"vidtrack": _version(), "rule": arguments.rule, "settings": settings, "inputs": checksums},
        threads=arguments.threads,
    )


def _derived(inputs: dict[str, str | list[str]], known: dict[str, str]) -> dict[str, str]:
    """Checksums of the inputs that earlier rules made."""
    paths = [p for value in inputs.values() for p in ([value] if isinstance(value, str) else value)]
    answer = {}
    for path in sorted(set(paths) - set(known)):
        with open(path, "rb") as file:
            answer[path] = hashlib.file_digest(file, "sha256").hexdigest()
    return answer


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

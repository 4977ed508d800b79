"""From a rule's command line to its job, and from an error to one line, a log and exit code 1."""

from __future__ import annotations

import argparse
import errno
import hashlib
import importlib
import json
import os
import sys
import traceback
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any, NoReturn

from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import remove_partial
from vidtrack.progress import announce, announce_end
from vidtrack.workflow.failure import remove_failure, write_failure
from vidtrack.workflow.fingerprint import PACKAGE, REMEMBERED, Checksums, state_of
from vidtrack.workflow.job import Job, module_of
from vidtrack.workflow.provenance import (
    Account,
    Order,
    canonical,
    commit,
    experiment_of,
    job_parts,
    version_of,
    versions,
    write_account,
)
from vidtrack.workflow.speaker import Speaker, refused

OPTIONS = ("--settings", "--input", "--output", "--account", "--log", "--threads", "--help", "-h")


SAID = b"vidtrack: "
"""How each log begins."""


def main(argv: Sequence[str]) -> int:
    """Run one job; 0 when its outputs stand, 1 when it failed and said why, 130 when someone pressed Ctrl-C."""
    # a path may begin with a dash
    arguments = _parser().parse_args([a if a in OPTIONS or not a.startswith("-") else f"./{a}" for a in argv])
    try:
        announce(_name(arguments))
        _clear(arguments)
        order = _order(arguments.settings)
        job, used = _job(arguments, order)
        raw = _raw(arguments, order)
        announce(_name(arguments))  # a checksum of a long recording was announced meanwhile
        importlib.import_module(module_of(arguments.rule)).run(job)
        if changed := [path for path, state in raw.items() if state_of(path) != state]:
            raise VidtrackError(*(f"{path}: changed while it was read. Run again." for path in changed))
        if arguments.account:
            experiment = experiment_of(arguments.account)
            made = _checksums(experiment, job.outputs.values())
            write_account(arguments.account, Account(order, used, made))
    except VidtrackError as error:
        return _failed(arguments, error.problems)
    except OSError as error:
        return _failed(arguments, [refused(error, _written(arguments))], cause=error)
    except KeyboardInterrupt:
        return 130
    except Exception as error:
        what = " ".join(str(error).split()) or "no message"
        details = f"the log {arguments.log} has the details" if arguments.log else "the details follow"
        line = f"{arguments.rule}: unexpected {type(error).__name__}: {what}. This is a fault of vidtrack; {details}."
        return _failed(arguments, [line], traceback.format_exc())
    finally:
        announce_end()
    return 0


def prepare() -> None:
    """Compute what is the same for all jobs."""
    _parser()
    versions()


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"vidtrack: {message}. See vidtrack rule --help.\n")


@cache
def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="vidtrack rule",
        description="Run one rule of the workflow; its order comes on the standard input.",
        epilog="Example, as Snakemake calls it: vidtrack rule verdict --input records results/calibration/*.json "
        "--output verdict verdict.json --settings verdict-order.json",
    )
    parser.add_argument("rule", help="the rule's name")
    parser.add_argument(
        "--settings", help="a JSON file of settings and inputs' checksums, instead of the standard input"
    )
    parser.add_argument(
        "--input", nargs="+", action="append", default=[], metavar=("NAME", "PATH"), help="NAME PATH ..."
    )
    parser.add_argument("--output", nargs=2, action="append", default=[], metavar=("NAME", "PATH"))
    parser.add_argument("--account", help="where the account of the job is written")
    parser.add_argument("--log", help="where a problem is also written")
    parser.add_argument("--threads", type=int, default=1)
    return parser


def _name(arguments: argparse.Namespace) -> str:
    """What a person calls the job: its rule, and what distinguishes it from others of its rule."""
    parts = job_parts(arguments.account) if arguments.account else []
    return f"{arguments.rule} {'/'.join(parts)}".rstrip()


def _clear(arguments: argparse.Namespace) -> None:
    """Remove what an earlier try of this job left: its log, its failure, its unfinished outputs."""
    if arguments.log and _is_log(arguments.log):
        with suppress(OSError):  # what cannot be removed cannot be written: said when there is something to write
            os.unlink(arguments.log)
    if arguments.account:
        remove_failure(arguments.account)
    for path in [*(path for _, path in arguments.output), *filter(None, [arguments.account])]:
        remove_partial(path)


def _is_log(path: str) -> bool:
    """Whether a file is what an earlier try wrote: never a device, nor a file of other content."""
    if not os.path.isfile(path):
        return False
    try:
        with open(path, "rb") as file:
            return SAID.startswith(file.read(len(SAID)))  # or its beginning, where the disk was full
    except OSError:
        return True


def _order(settings: str | None) -> Order:
    """The order, from three lines on the standard input or from a file that a person wrote."""
    if settings is None:
        lines = sys.stdin.read().splitlines()
        if len(lines) != len(Order._fields):
            raise VidtrackError(
                "no order on the standard input. Call snakemake, or name a file of settings with --settings."
            )
        return Order(*lines)
    with open(settings, encoding="utf-8") as file:
        given = json.load(file)
    return Order(canonical(given["settings"]), canonical(given.get("inputs", {})), canonical({}))


def _job(arguments: argparse.Namespace, order: Order) -> tuple[Job, dict[str, str]]:
    """The job, and the checksums of the results of earlier rules that it reads."""
    inputs = {name: paths[0] if len(paths) == 1 else paths for name, *paths in arguments.input if paths}
    settings, files = json.loads(order.settings), json.loads(order.files)
    paths = [p for value in inputs.values() for p in ([value] if isinstance(value, str) else value)]
    if arguments.account:
        experiment = experiment_of(arguments.account)
        used = _checksums(experiment, (p for p in paths if _inside(p, os.path.join(experiment, "results"))))
    else:
        used = _checksums("", (p for p in paths if p not in files))
    provenance: dict[str, Any] = {
        "vidtrack": version_of("vidtrack"),
        "commit": commit(PACKAGE),
        "code": json.loads(order.code).get("code"),
        "libraries": versions(),
        "rule": arguments.rule,
        "settings": settings,
        "inputs": {**files, **used},
    }
    return Job(settings, inputs, dict(arguments.output), provenance, arguments.threads), used


def _raw(arguments: argparse.Namespace, order: Order) -> dict[str, list[int]]:
    """The files that people made, each with the state that it is in; VidtrackError where one is not what was ordered.

    A file that is replaced after the order was written, and put back before the next call, would else leave the results
    of what it was meanwhile.
    """
    if not arguments.account:
        return {}
    experiment, files = experiment_of(arguments.account), json.loads(order.files)
    results = os.path.join(experiment, "results")
    paths = [path for _, *some in arguments.input for path in some if not _inside(path, results)]
    gone = [path for path in paths if os.path.relpath(path, experiment) in files and not os.path.lexists(path)]
    if gone:
        raise VidtrackError(
            *(f"{path}: is gone since this run was planned. Put it back, or run again." for path in gone)
        )
    states = {path: state_of(path) for path in paths if os.path.isfile(path)}
    ordered = {path: files[name] for path in states if (name := os.path.relpath(path, experiment)) in files}
    if not ordered:  # what is remembered of a season is long, and most jobs read results alone
        return states
    checksums = Checksums(REMEMBERED)
    for path, checksum in ordered.items():
        if checksums.of(path) != checksum:
            raise VidtrackError(f"{path}: is another file than when this run was planned. Run again.")
    return states


def _inside(path: str, folder: str) -> bool:
    return not os.path.relpath(path, folder).startswith(os.pardir)


def _checksums(experiment: str, paths: Iterable[str]) -> dict[str, str]:
    """Checksums of files by their path inside the experiment's folder, or as they are spelled where it has none."""
    answer = {}
    for path in sorted(set(paths)):
        with open(path, "rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        answer[os.path.relpath(path, experiment) if experiment else path] = digest
    return answer


def _written(arguments: argparse.Namespace) -> str:
    """Where a job writes: a disk that is full names no file."""
    return os.path.dirname(next((path for _, path in arguments.output), "")) or os.curdir


def _failed(
    arguments: argparse.Namespace, problems: Sequence[str], details: str = "", cause: OSError | None = None
) -> int:
    """Say and write down why the job failed.

    cause   what the system refused, where it is that
    """
    speaker = Speaker()
    if cause is None:
        speaker.say(problems)
    else:
        speaker.say_refused(cause, _written(arguments))
    if not arguments.log:
        sys.stderr.write(details)
    with _said(speaker, cause):
        if arguments.log:
            if os.path.isfile(arguments.log) and not _is_log(arguments.log):
                raise OSError(errno.EEXIST, "a file that is no log is there", arguments.log)
            os.makedirs(os.path.dirname(arguments.log) or ".", exist_ok=True)
            with open(arguments.log, "w", encoding="utf-8") as file:
                file.write("".join(f"vidtrack: {problem}\n" for problem in problems) + details)
    with _said(speaker, cause):
        if arguments.account:
            write_failure(arguments.account, arguments.rule, problems)
    return 1


@contextmanager
def _said(speaker: Speaker, cause: OSError | None) -> Iterator[None]:
    """One more line where a problem cannot be written down, and not for the same reason; the problem has been said."""
    try:
        yield
    except OSError as error:
        if cause is not None and error.errno == cause.errno:
            return
        error.strerror = f"cannot be written ({error.strerror})"
        speaker.say_refused(error, "the log")

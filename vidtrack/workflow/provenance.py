"""The account of a job that ended well: what it had to do, what it read, what it made.

One small JSON file a job under `<results>/.provenance`. It holds checksums, no dates and no absolute paths: a folder
may be moved or copied, and what is recorded still says whether its results are those of the present settings.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple

from vidtrack.files.atomic import replacing
from vidtrack.workflow.fingerprint import LIBRARIES

FOLDER = ".provenance"

PARTIAL = '"partial":true'
"""Stands in the order of a job that ran without all of its inputs; no rule asks for such a one."""


class Order(NamedTuple):
    """All that decides what a job makes, each part as one line of JSON with sorted keys.

    settings   exactly the settings that the rule uses
    files      checksums of the inputs that people made, by their path inside the experiment's folder
    code       the fingerprint of the rule's code, and the versions of the libraries that it uses
    """

    settings: str
    files: str
    code: str


class Account(NamedTuple):
    """What a job that ended well wrote down: its order; checksums of the results that it read, and of those it made."""

    order: Order
    used: Mapping[str, str]
    made: Mapping[str, str]


def place(results: str, rule: str, *parts: str) -> str:
    """Where the account of a job lies."""
    return os.path.join(results, FOLDER, rule, *parts[:-1], f"{parts[-1]}.json" if parts else "job.json")


def experiment_of(account: str) -> str:
    """The experiment's folder, of the account of one of its jobs."""
    results = account.replace(os.sep, "/").rpartition(f"/{FOLDER}/")[0]
    return os.path.dirname(results) or "."


def job_parts(account: str) -> list[str]:
    """What distinguishes a job from others of its rule (run, camera), of the place of its account."""
    return os.path.splitext(account.replace(os.sep, "/").rpartition(f"/{FOLDER}/")[2])[0].split("/")[1:]


def canonical(value: Mapping[str, Any]) -> str:
    """One line of JSON, the same for the same content, whatever the order of its keys."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def write_account(path: str, account: Account) -> None:
    """Write the account of a job that ended well."""
    record = {**account.order._asdict(), "used": account.used, "made": account.made}
    with replacing(path) as file:
        file.write((json.dumps(record, sort_keys=True, indent=1) + "\n").encode())


def read_account(path: str) -> Account | None:
    """The account at `path`; None where there is none or it is damaged."""
    try:
        with open(path, encoding="utf-8") as file:
            record = json.load(file)
        order = Order(*(str(record[name]) for name in Order._fields))
        return Account(order, dict(record["used"]), dict(record["made"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def versions(names: Mapping[str, str] = LIBRARIES) -> dict[str, str]:
    """The installed versions of packages, by the name that is imported."""
    return {name: version_of(package) for name, package in names.items()}


@cache
def version_of(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def commit(package: str) -> str | None:
    """The git commit that is checked out where the package lies; None where it lies in no checkout.

    Read from git's files: starting git would cost each job more than its own start.
    """
    git = os.path.join(os.path.dirname(package), ".git")
    try:
        if os.path.isfile(git):  # a worktree
            git = os.path.normpath(os.path.join(os.path.dirname(git), _text(git).removeprefix("gitdir: ")))
        head = _text(os.path.join(git, "HEAD"))
        if not head.startswith("ref: "):
            return head
        common = os.path.join(git, "commondir")
        shared = os.path.join(git, _text(common)) if os.path.isfile(common) else git
        return _reference(shared, head.removeprefix("ref: "))
    except OSError:
        return None


def _reference(git: str, name: str) -> str | None:
    path = os.path.join(git, *name.split("/"))
    if os.path.isfile(path):
        return _text(path)
    for line in _text(os.path.join(git, "packed-refs")).splitlines():
        value, _, reference = line.partition(" ")
        if reference == name:
            return value
    return None


def _text(path: str) -> str:
    with open(path, encoding="utf-8") as file:
        return file.read().strip()

"""Results of earlier calls that do not belong to the present settings and inputs, and are there all the same.

Where a job fails, what earlier calls made of its results stays: once the earlier settings come back it counts again,
and no recording is read anew. Until then a note beside it, the verdict, the report and the terminal say what it is.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from vidtrack.files.experiment import within
from vidtrack.files.outdated_note import NAME, write_note
from vidtrack.workflow.failure import FOLDER as FAILURES
from vidtrack.workflow.order_book import OrderBook
from vidtrack.workflow.provenance import FOLDER as ACCOUNTS
from vidtrack.workflow.provenance import Account, read_account

RECORD = "outdated.json"

CONCLUDING = ("verdict", "report", "report_run", "report_calibration", "campaign")
"""Rules whose results are made anew, or removed, whatever fails."""


def outdated(book: OrderBook) -> list[str]:
    """The results, by their places under results/, that are there and are not as the present orders want them.

    Those of jobs that are wanted, unless they are settled; and those that no job makes any more, where what they were
    made of has changed.
    """
    wanted = {book.place(*key): key for key in book.jobs}
    accounts = {
        path: account
        for path in _accounts(book.results)
        if (account := book.done.get(wanted.get(path, ())) or read_account(path))
    }
    others = {path: own for path, own in accounts.items() if path not in wanted and _rule(book, path) not in CONCLUDING}
    found = [own for path, own in accounts.items() if path in wanted and wanted[path][0] not in CONCLUDING]
    places = {place for own in found for place in _made(book, own) if place not in book.settled}
    kept = {place for own in found for place in _made(book, own)}
    places |= {place for own in _changed(book, others) for place in _made(book, own)} - kept
    return sorted(os.path.relpath(place, book.results) for place in places if os.path.isfile(place))


def note(results: str, places: Sequence[str]) -> None:
    """Write a note into each folder of a run or a calibration that holds such results, and none elsewhere."""
    folders: dict[str, list[str]] = {}
    for place in places:
        part, name, *deeper = [*place.split(os.sep), ""]
        folder = os.path.join(part, name) if part == "runs" else part if name and deeper else ""
        folders.setdefault(os.path.join(results, folder), []).append(place)
    for path in _notes(results):
        if os.path.dirname(path) not in {os.path.normpath(folder) for folder in folders}:
            os.unlink(path)
    for folder, own in folders.items():
        write_note(folder, own)


def record(results: str, places: Sequence[str]) -> list[str]:
    """Write the record that the verdict reads; its path in a list, which is empty where nothing is outdated."""
    from vidtrack.files.records import write_record  # what it needs is for calls in which something failed

    path = os.path.join(results, FAILURES, RECORD)
    if not places:
        forget(results)
        return []
    write_record(path, {"rule": "outdated", "parts": [], "findings": [], "outdated": list(places)})
    return [path]


def forget(results: str) -> None:
    """Remove the record of an earlier call."""
    path = os.path.join(results, FAILURES, RECORD)
    if os.path.isfile(path):
        os.unlink(path)
        if not os.listdir(os.path.dirname(path)):
            os.rmdir(os.path.dirname(path))


def _accounts(results: str) -> list[str]:
    folder = os.path.join(results, ACCOUNTS)
    return [
        os.path.join(here, name) for here, _, names in os.walk(folder) for name in sorted(names) if name[-5:] == ".json"
    ]


def _rule(book: OrderBook, path: str) -> str:
    return os.path.relpath(path, os.path.join(book.results, ACCOUNTS)).split(os.sep)[0]


def _made(book: OrderBook, account: Account) -> list[str]:
    try:
        return [within(book.folder, name) for name in account.made]
    except ValueError:  # a damaged account may hold a name that none can have
        return []


def _changed(book: OrderBook, others: Mapping[str, Account]) -> list[Account]:
    """Accounts of jobs that are not wanted, of which something that they read is no longer what it was."""
    made = {name: checksum for own in others.values() for name, checksum in own.made.items()}
    known = {name: checksum for own in book.done.values() for name, checksum in own.made.items()}
    good = {
        path: own
        for path, own in others.items()
        if all(made.get(name, known.get(name)) == checksum for name, checksum in own.used.items())
    }
    makers = {name: path for path, own in others.items() for name in own.made}
    while spoilt := [p for p, own in good.items() if any(makers.get(n, p) not in good for n in own.used)]:
        for path in spoilt:
            del good[path]
    return [own for path, own in others.items() if path not in good]


def _notes(results: str) -> list[str]:
    folders = [results, *(os.path.join(results, part) for part in _folders(results))]
    folders += [os.path.join(results, "runs", name) for name in _folders(os.path.join(results, "runs"))]
    return [path for folder in folders if os.path.isfile(path := os.path.normpath(os.path.join(folder, NAME)))]


def _folders(folder: str) -> list[str]:
    here = os.scandir(folder) if os.path.isdir(folder) else ()
    return sorted(entry.name for entry in here if entry.is_dir())

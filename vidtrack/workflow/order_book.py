"""What each job of an experiment has to do, and which results are of just that: reading it writes nothing.

A job is done where its account (see provenance.py) holds the present order, the results that it made are as it made
them, and those that it read are as they are now. Dates count for nothing: neither a touched file nor one from the
future, nor a folder that was moved or copied, changes the answer.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

from vidtrack.errors import VidtrackError
from vidtrack.files.beside import may_be_recording
from vidtrack.files.experiment import within
from vidtrack.workflow.fingerprint import LIBRARIES, Checksums, Fingerprints
from vidtrack.workflow.job import module_of
from vidtrack.workflow.provenance import (
    FOLDER,
    Account,
    Order,
    canonical,
    place,
    read_account,
    versions,
)

Raw = str | tuple[str, ...]
"""A file that people made, or those of one recording."""

Key = tuple[str, ...]
"""A job: its rule, and what distinguishes it from others of its rule (run, camera)."""


class OrderBook:
    """The orders of one experiment.

    folder   the experiment's folder
    cache    a folder where checksums are kept from call to call, once `save` is called
    """

    def __init__(self, folder: str, cache: str) -> None:
        self.folder = folder
        self.results = within(folder, "results")
        self._checksums = Checksums(os.path.join(cache, "checksums.json"))
        self._code = Fingerprints(os.path.join(cache, "code.json"))
        self._wanted: dict[Key, tuple[Mapping[str, Any], tuple[Raw, ...]]] = {}
        self._orders: dict[Key, Order] = {}
        self._rules: dict[str, str] = {}

    def add(self, rule: str, settings: Mapping[str, Any], raw: Iterable[Raw | None] = (), *parts: str) -> None:
        """Note that a job is wanted.

        raw      the paths of the inputs that people made: their content is what counts; a tuple of paths is one
                 recording in several files
        parts    what distinguishes the job from others of its rule: run, camera
        """
        self._wanted[rule, *parts] = settings, tuple(path for path in raw if path)

    def order(self, rule: str, *parts: str) -> Order:
        """The order of one job; VidtrackError where an input cannot be read."""
        key = (rule, *parts)
        if key not in self._orders:
            settings, raw = self._wanted[key]
            self._orders[key] = Order(canonical(settings), canonical(self._files(raw)), self._code_of(rule))
        return self._orders[key]

    def check(self) -> None:
        """Open each recording whose content is new.

        VidtrackError, a line each, for what cannot be named, read or written. A recording of a run that cannot be
        opened costs that run alone, where the recordings of another run can be: its jobs say why.
        """
        files = [path for _, raw in self._wanted.values() for one in raw for path in _paths(one)]
        if unnamable := _unnamable([self.folder, *files]):
            raise VidtrackError(*unnamable)
        problems = self._unreadable_recordings()
        problems += _unwritable(os.path.join(self.results, FOLDER))
        if problems:
            raise VidtrackError(*problems)
        for key in self._wanted:
            self.order(*key)

    def _unreadable_recordings(self) -> list[str]:
        """What hinders recordings from being opened, a line each; without those of single runs among several."""
        of_run: dict[str, str] = {}
        for (rule, *parts), (_, raw) in self._wanted.items():
            if rule == "track":
                of_run |= {_paths(one)[0]: run for run in parts[:1] for one in raw}
        firsts = {_paths(one)[0]: None for _, raw in self._wanted.values() for one in raw}
        fresh = [path for path in firsts if may_be_recording(path) and not self._knows(path)]
        lines = {path: found for path in fresh if (found := _unreadable(path))}
        lost = {of_run[path] for path in lines if path in of_run}
        if lost < set(of_run.values()):
            lines = {path: found for path, found in lines.items() if path not in of_run}
        return [line for found in lines.values() for line in found]

    def place(self, rule: str, *parts: str) -> str:
        """Where the account of a job lies."""
        return place(self.results, rule, *parts)

    @property
    def jobs(self) -> list[Key]:
        """All jobs that are wanted."""
        return list(self._wanted)

    @cached_property
    def done(self) -> dict[Key, Account]:
        """The jobs that need not run again for their own sake, with their accounts."""
        accounts = {key: account for key in self._wanted if (account := read_account(self.place(*key)))}
        made = {name: checksum for account in accounts.values() for name, checksum in account.made.items()}
        return {
            key: account
            for key, account in accounts.items()
            if account.order == self.order(*key)
            and all(made.get(name) == checksum for name, checksum in account.used.items())
            and all(self._holds(name, checksum) for name, checksum in account.made.items())
        }

    @cached_property
    def settled(self) -> set[str]:
        """The paths of all results that are as they should be, and so is everything that they were made of."""
        makers = {name: key for key, account in self.done.items() for name in account.made}
        good = dict(self.done)
        while spoilt := [key for key, account in good.items() if not {makers.get(n) for n in account.used} <= {*good}]:
            for key in spoilt:
                del good[key]
        names = {name for account in good.values() for name in account.made}
        return {within(self.folder, name) for name in names} | {self.place(*key) for key in good}

    def unsettled(self) -> dict[str, Order]:
        """The jobs that have to run: the path of the account of each, and its order."""
        return {self.place(*key): self.order(*key) for key in self._wanted if key not in self.done}

    def checksum(self, path: str) -> str:
        """The SHA-256 of a file, read only where it is not kept for the file's state; OSError where it cannot be."""
        return self._checksums.of(path)

    def look_again(self) -> None:
        """Discard what was computed: jobs have run meanwhile."""
        for name in ("done", "settled"):
            self.__dict__.pop(name, None)

    def save(self) -> None:
        """Save checksums for the next call, where the cache can be written."""
        try:
            self._checksums.save()
            self._code.save()
        except OSError:
            return

    def _code_of(self, rule: str) -> str:
        if rule not in self._rules:
            modules = module_of(rule), "vidtrack.workflow.entry"
            used = {name: LIBRARIES[name] for name in self._code.libraries(*modules)}
            self._rules[rule] = canonical({"code": self._code.of(*modules), "libraries": versions(used)})
        return self._rules[rule]

    def _files(self, raw: tuple[Raw, ...]) -> dict[str, str]:
        files: dict[str, str] = {}
        for one in raw:
            path, *others = _paths(one)
            checksum = self._checksum(path)
            if others:
                each = [f"{os.path.basename(other)} {self._checksum(other)}" for other in others]
                checksum = hashlib.sha256("\n".join([checksum, *each]).encode()).hexdigest()
            name = os.path.relpath(path, self.folder)
            if name.startswith(os.pardir):  # a recording elsewhere: moving the experiment does not make it another
                name = os.path.basename(path)
            name += f" and {len(others)} more" if others else ""
            while name in files:
                name += "+"
            files[name] = checksum
        return files

    def _checksum(self, path: str) -> str:
        try:
            return self._checksums.of(path)
        except OSError as error:
            raise VidtrackError(f"{path}: cannot be read ({error.strerror}). Make it readable.") from None

    def _knows(self, path: str) -> bool:
        try:
            return self._checksums.knows(path)
        except OSError:
            return False

    def _holds(self, name: str, checksum: str) -> bool:
        try:
            return self._checksums.of(within(self.folder, name)) == checksum
        except (OSError, ValueError):  # a damaged account may hold a name that none can have
            return False


def _paths(raw: Raw) -> tuple[str, ...]:
    return (raw,) if isinstance(raw, str) else raw


def _unnamable(paths: Iterable[str]) -> list[str]:
    """Files and folders whose names Snakemake or a line of text cannot hold, a line each."""
    found: dict[str, None] = {}
    for path in paths:
        if bad := re.search(r"[{}\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]", path):
            end = path.find("/", bad.start())
            found[path if end < 0 else path[:end]] = None
    return [
        f"{path!r}: a name may hold no braces, line breaks or other control characters, and must be UTF-8. Rename it."
        for path in found
    ]


def _unreadable(path: str) -> tuple[str, ...]:
    """What hinders a recording from being opened, if anything does."""
    from vidtrack.video.reader import open_video

    try:
        with open_video(path):
            return ()
    except VidtrackError as error:
        return error.problems


def _unwritable(folder: str) -> list[str]:
    """What hinders a folder from being made and written to, if anything does."""
    place = os.path.abspath(folder)
    while not os.path.lexists(place):
        place = os.path.dirname(place)
    if not os.path.isdir(place):
        return [
            f"{folder}: cannot be written (there is a file in its way). Move {os.path.relpath(place)} and run again."
        ]
    if not os.access(place, os.W_OK | os.X_OK):
        return [f"{folder}: cannot be written (permission denied). Make {os.path.relpath(place)} writable."]
    return []

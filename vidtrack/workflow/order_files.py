"""Orders on paper: for each job a small file of its settings, its raw inputs' checksums and its code's fingerprint.

The file is an input of its rule and is written only when its content changes, so that one mechanism, the oldest
in the book, decides what runs again: settings, edited files and edited code all show as a newer order.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any

from vidtrack.errors import VidtrackError
from vidtrack.files.atomic import replacing
from vidtrack.files.experiment import NO_RECORDING, within
from vidtrack.workflow.fingerprint import Checksums, Fingerprints


class OrderBook:
    """The orders of one experiment, under `<results>/.orders`.

    results    the experiment's results folder
    writing    False where the workflow is parsed only to run one job of an order that stands already
    """

    def __init__(self, results: str, *, writing: bool = True) -> None:
        self.folder = within(results, ".orders")
        self.writing = writing
        self._checksums = Checksums(within(self.folder, "checksums.json"))
        self._code = Fingerprints(within(self.folder, "code.json"))
        self._fresh: dict[str, None] = {}

    def place(self, rule: str, settings: Mapping[str, Any], raw: Iterable[str | None] = (), *parts: str) -> str:
        """Write the order of one job, if it has changed, and answer its path.

        raw      the paths of the inputs that people made: their content is what counts, not their dates
        parts    what tells the job from others of its rule: run, camera
        Raises VidtrackError where an input cannot be read or the order cannot be written.
        """
        path = within(self.folder, ".".join((rule, *parts)) + ".json")
        if not self.writing:
            return path
        order = {
            "rule": rule,
            "code": self._code.of(f"vidtrack.jobs.{rule}"),
            "inputs": {name: self._checksum(name) for name in raw if name},
            "settings": settings,
        }
        text = json.dumps(order, sort_keys=True, indent=1) + "\n"
        try:
            if not _holds(path, text):
                with replacing(path) as file:
                    file.write(text.encode())
        except OSError as error:
            raise _unwritable(path, error) from None
        return path

    def close(self) -> None:
        """Remember the checksums for the next call.

        A recording that is new or has changed is opened first: VidtrackError, a line each, where one cannot be read;
        and one where the checksums cannot be written.
        """
        if not self.writing:
            return
        problems: list[str] = []
        for path in self._fresh:
            if os.path.splitext(path)[1].lower() not in NO_RECORDING:
                problems += _unreadable(path)
        if problems:
            raise VidtrackError(*problems)
        try:
            self._checksums.save()
            self._code.save()
        except OSError as error:
            raise _unwritable(self.folder, error) from None

    def _checksum(self, path: str) -> str:
        try:
            known = self._checksums.knows(path)
            checksum = self._checksums.of(path)
        except OSError as error:
            raise VidtrackError(f"{path}: cannot be read ({error.strerror}). Mend it and run again.") from None
        if not known:
            self._fresh[path] = None
        return checksum


def _unreadable(path: str) -> tuple[str, ...]:
    """What hinders a recording from being opened, if anything does."""
    from vidtrack.video.reader import open_video

    try:
        with open_video(path):
            return ()
    except VidtrackError as error:
        return error.problems


def _unwritable(path: str, error: OSError) -> VidtrackError:
    return VidtrackError(
        f"{path}: cannot be written ({error.strerror}). See that the results folder is yours to write in and the disk "
        "has room, and run again."
    )


def _holds(path: str, text: str) -> bool:
    if not os.path.isfile(path):
        return False
    with open(path, encoding="utf-8") as file:
        return file.read() == text

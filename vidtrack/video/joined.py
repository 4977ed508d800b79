"""Files that follow each other as one recording: cameras begin a new one every few gigabytes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

from vidtrack.errors import VidtrackError
from vidtrack.timing.frame import Frame, ReadAccount, VideoInfo
from vidtrack.video.recording import Monitor, Video

LATE = Fraction(5)
"""s by which a file may begin later, by stamps that run on from file to file, and still belong to them."""

SEAM = Fraction(3, 2)
"""Frames: files that begin within this of the last picture's end follow without a gap."""


class JoinedVideo(Video):
    """Several files as one recording.

    Each is placed by time stamps that run on from file to file, or else by time code, or else right behind the one
    before it.
    """

    def __init__(self, paths: Sequence[str], opened: Callable[[str], Video]) -> None:
        self.path, self._paths, self._open = paths[0], list(paths), opened
        self._now = opened(paths[0])
        self.info = replace(self._now.info, n_frames_hint=None, length_hint=None, duration=None)
        self._accounts: list[ReadAccount] = []
        self._notes: list[str] = []
        self._used = False
        self._parts: list[tuple[int, Video]] = []  # the number of a file's first frame in all, and the file

    def close(self) -> None:
        """Release the file that is open."""
        self._now.close()

    @property
    def account(self) -> ReadAccount:
        """The accounts of all files as one; problems name the file that they are of."""
        each = [*self._accounts, self._now.account] if len(self._accounts) < len(self._paths) else self._accounts
        problems = [
            line if k == 0 else f"{os.path.basename(self._paths[k])}: {line}"
            for k, account in enumerate(each)
            for line in account.problems
        ]
        frames, lost = sum(account.frames for account in each), sum(account.lost for account in each)
        return ReadAccount(frames, lost, sum(account.corrupt for account in each), (*problems, *self._notes))

    def frames(
        self, *, ahead: bool = False, apart: bool = False, monitor: Monitor | None = None, targets: int = 0
    ) -> Iterator[Frame]:
        """As `Video.frames`."""
        if self._used:
            raise ValueError("frames() reads a recording once; open it again to read it again")
        self._used = True
        index, begins, step = 0, Fraction(0), 1 / self.info.rate
        ends = Fraction(0)
        for k, path in enumerate(self._paths):
            if k:
                self._now.close()
                self._now = self._open(path)
                self._check(path)
                begins = self._placed(path, ends)
            self._parts.append((index, self._now))
            for frame in self._now.frames(ahead=ahead, apart=apart):
                time = begins + frame.time
                yield frame._replace(index=index, time=time)
                index, ends = index + 1, time + step
            self._accounts.append(self._now.account)

    def look_again(self, indices: Sequence[int]) -> set[int]:
        """As `Video.look_again`; a picture is looked at in the file that it is in."""
        found, end = set[int](), max(indices, default=-1) + 1
        for first, video in reversed(self._parts):
            own = [index - first for index in indices if first <= index < end]
            found |= {first + index for index in video.look_again(own)}
            end = first
        return found

    def _check(self, path: str) -> None:
        first, now = self.info, self._now.info
        if (first.width, first.height, first.bits) != (now.width, now.height, now.bits):
            raise VidtrackError(
                f"{path}: {now.width} x {now.height} pixels of {now.bits} bits, where {self.path} has {first.width} x "
                f"{first.height} of {first.bits}: no parts of one recording. Take out what does not belong to it."
            )

    def _placed(self, path: str, ends: Fraction) -> Fraction:
        """s at which the file's first picture lies, where the one before it ended at `ends`."""
        now, step, name = self._now.info, 1 / self.info.rate, os.path.basename(path)
        by_stamps = (now.start - self.info.start) * self.info.pace
        by_code = _by_code(self.info, now)
        if abs(by_stamps - ends) < SEAM * step or (by_code is not None and abs(by_code - ends) < SEAM * step):
            return ends
        if ends < by_stamps < ends + LATE:
            self._notes.append(f"{name} begins {float(by_stamps - ends):.2f} s after the end of the file before it")
            return by_stamps
        if by_code is not None and by_code > ends:
            self._notes.append(
                f"{name} begins {float(by_code - ends):.2f} s after the end of the file before it, by time code"
            )
            return by_code
        if by_code is not None:
            self._notes.append(
                f"{name} begins {float(ends - by_code):.2f} s before the end of the file before it, by time code: it "
                "is placed behind it. Are these parts of one recording, in the right order?"
            )
        return ends


def _by_code(first: VideoInfo, now: VideoInfo) -> Fraction | None:
    a, b = first.time, now.time
    if not a.anchors or not b.anchors or a.source != b.source or a.code_rate != b.code_rate:
        return None
    return (b.anchors[0].frame - a.anchors[0].frame) / a.code_rate * first.pace

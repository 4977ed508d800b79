"""What every recording offers, however its pictures are stored."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Self

from vidtrack.timing.frame import Frame, ReadAccount, VideoInfo


class Video(ABC):
    """An open recording, a context manager; see `vidtrack.video.reader.open_video`.

    path  of its file, or of the first of its files
    info  what it says of itself
    """

    path: str
    info: VideoInfo

    @abstractmethod
    def frames(self, *, ahead: bool = False, apart: bool = False) -> Iterator[Frame]:
        """Every picture that can be decoded, in order of time. Once per opening: raises ValueError the second time.

        Frame.luma is a view into the decoder's picture; hold few of them.
        ahead  whether a thread of its own decodes the next ones while these are in use
        apart  the same, and where the decoder has no threads of its own, `threads` processes decode instead: for
               programs that do nothing else at that time
        """

    @property
    @abstractmethod
    def account(self) -> ReadAccount:
        """How the reading went; complete once `frames` has come to its end."""

    def look_again(self, indices: Sequence[int]) -> set[int]:
        """When all are read: damaged frames that are not flagged so, where those of `indices` changed suddenly.

        indices  the most doubtful one first: there is a limit to what is looked at
        """
        return set()

    @abstractmethod
    def close(self) -> None:
        """Release the file; frames that were given become invalid."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

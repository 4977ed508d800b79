"""What every recording offers, however its pictures are stored."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from types import TracebackType
from typing import Any, Protocol, Self

from vidtrack.timing.frame import Frame, ReadAccount, VideoInfo


class Monitor(Protocol):
    """What looks at frames.

    monitored    the frames, unchanged, while it looks at them
    elsewhere  called before the first frame where another process looks at them, and this one is to look at none
    seen       what there is to be known when all have passed, to be pickled; taken: called with it in this process
    """

    def monitored(self, frames: Iterable[Frame]) -> Iterator[Frame]: ...

    def elsewhere(self) -> None: ...

    def seen(self) -> Any: ...

    def taken(self, seen: Any) -> None: ...


class Video(ABC):
    """An open recording, a context manager; see `vidtrack.video.reader.open_video`.

    path  of its file, or of the first of its files
    info  what it says of itself
    """

    path: str
    info: VideoInfo

    @abstractmethod
    def frames(
        self, *, ahead: bool = False, apart: bool = False, monitor: Monitor | None = None, targets: int = 0
    ) -> Iterator[Frame]:
        """Every picture that can be decoded, in order of time. Once per opening: raises ValueError the second time.

        Frame.luma is a view into the decoder's picture; hold few of them.
        ahead  whether a thread of its own decodes the next ones while these are in use
        apart  the same, and where the decoder has no threads of its own, `threads` processes decode instead: for
               programs that do nothing else at that time
        monitor  what looks at all frames: a process that decodes them does so where it would wait for this one, which
               follows so many targets in them. The account is then complete at the end, and empty before
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

"""A process that another one has forked, and that is of no use without it."""

import ctypes
import os
import signal
from contextlib import suppress

_PARENT_DIED = 1  # PR_SET_PDEATHSIG of Linux


def die_with(parent: int) -> None:
    """Let the system kill this process when `parent`, the process that forked it, ends, however that does.

    Elsewhere than on Linux nothing is done, unless it has ended already.
    """
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).prctl(_PARENT_DIED, signal.SIGKILL)
    if os.getppid() != parent:  # it died before
        os._exit(0)

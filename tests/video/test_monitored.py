import os
from itertools import islice

import numpy as np
import pytest

from tests.files.clips import make_clip, moving_ball
from vidtrack.errors import VidtrackError
from vidtrack.video import monitored
from vidtrack.video.monitored import SPARE
from vidtrack.video.processes.read_apart import CAN_FORK
from vidtrack.video.reader import open_video

pytestmark = pytest.mark.skipif(not CAN_FORK, reason="there is no fork here")

FILMS = {"tape.dv": ("dvvideo", "yuv411p", (720, 480)), "disc.mpg": ("mpeg2video", "yuv420p", (96, 64))}


class Sums:
    """Looks at the sum of each picture; where: the processes in which it looked."""

    def __init__(self, fails_at=None):
        self.sums, self.where, self.away, self.fails_at = {}, set(), False, fails_at

    def monitored(self, frames):
        for frame in frames:
            if frame.index == self.fails_at:
                raise VidtrackError("no more")
            if not self.away:
                self.sums[frame.index] = int(frame.luma.sum())
                self.where.add(os.getpid())
            yield frame

    def elsewhere(self):
        self.away = True

    def seen(self):
        return self.sums, self.where

    def taken(self, seen):
        self.sums, self.where = seen


def film(folder, name, n=12):
    codec, pix_fmt, size = FILMS[name]
    return make_clip(folder / name, codec, pix_fmt, n=n, size=size, picture=moving_ball(*size, speed=0.4))


def damaged(path):
    data = bytearray(path.read_bytes())
    at = len(data) // 2
    data[at : at + 300] = np.random.default_rng(1).integers(0, 256, 300, dtype=np.uint8).tobytes()
    path.write_bytes(data)


def read(path, monitor=None, targets=0, most=None):
    with open_video(str(path), threads=1) as video:
        passed = video.frames(apart=True, monitor=monitor, targets=targets)
        given = [
            f._replace(luma=f.luma.tobytes()) for f in islice(monitor.monitored(passed) if monitor else passed, most)
        ]
        return given, video.account


@pytest.mark.parametrize("name", FILMS)
@pytest.mark.parametrize("spoilt", [False, True])
def test_frames_that_the_decoders_process_looks_at_are_the_same_and_so_is_the_account(tmp_path, name, spoilt):
    path, monitor = film(tmp_path, name), Sums()
    if spoilt:
        damaged(path)
    given, account = read(path)
    assert read(path, monitor, SPARE[FILMS[name][0]]) == (given, account)
    assert monitor.where == monitor.where - {os.getpid()}
    assert monitor.sums == {f.index: sum(f.luma) for f in given}
    assert len(given) == account.frames >= 10
    assert spoilt == bool(account.problems)


def test_where_few_targets_are_followed_this_process_looks(tmp_path):
    path, monitor = film(tmp_path, "tape.dv"), Sums()
    assert read(path, monitor, SPARE["dvvideo"] - 1) == read(path)
    assert monitor.where == {os.getpid()}


def test_where_no_process_can_be_had_this_one_looks(tmp_path, monkeypatch):
    def none(*arguments):
        raise OSError("no more processes")

    path, monitor = film(tmp_path, "tape.dv"), Sums()
    whole = read(path)
    monkeypatch.setattr(monitored, "ReadApart", none)
    assert read(path, monitor, 1000) == whole
    assert monitor.where == {os.getpid()}


def test_what_looking_raises_in_the_other_process_is_raised_here_behind_the_frames_before(tmp_path):
    path, given = film(tmp_path, "tape.dv"), []
    with open_video(str(path), threads=1) as video, pytest.raises(VidtrackError, match="no more"):
        for frame in video.frames(apart=True, monitor=Sums(fails_at=7), targets=1000):
            given.append(frame.index)
    assert given == [*range(7)]


def test_who_stops_early_ends_the_process(tmp_path, monkeypatch):
    processes = []

    class Noted(monitored.ReadApart):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            processes.append(self._process)

    monkeypatch.setattr(monitored, "ReadApart", Noted)
    path = film(tmp_path, "tape.dv")
    assert read(path, Sums(), 1000, most=3)[0] == read(path)[0][:3]
    (process,) = processes
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)

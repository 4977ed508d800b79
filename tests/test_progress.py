import io

from vidtrack.progress import Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_log_stays_quiet():
    log = io.StringIO()
    with Progress("track", 1000, stream=log) as progress:
        assert list(progress.over(range(1000))) == list(range(1000))
    assert log.getvalue() == ""
    assert progress.done == 1000


def test_a_terminal_is_told_done_rate_and_time_left():
    progress = Progress("track pluck/cam1", 600, stream=Terminal())
    progress.done = 200
    assert progress.line(2.0) == "track pluck/cam1: 200 of 600 frames, 100/s, 0:04 left"


def test_without_a_total_no_time_left_is_made_up():
    progress = Progress("track", None, stream=Terminal())
    progress.done = 50
    assert progress.line(1.0) == "track: 50 frames, 50/s"


def test_the_line_is_gone_when_the_work_is_done():
    screen = Terminal()
    with Progress("track", 3, stream=screen) as progress:
        progress._shown = -1e9
        progress.advance()
    assert "1 of 3" in screen.getvalue()
    assert screen.getvalue().endswith("\r\x1b[K")

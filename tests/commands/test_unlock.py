import io
import subprocess
import sys

import pytest

from vidtrack.command import main
from vidtrack.commands.unlock import free_lock
from vidtrack.errors import VidtrackError


@pytest.fixture
def locked(tmp_path):
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    (tmp_path / ".snakemake/locks/0.input.lock").write_text("x")
    return tmp_path


def test_a_stale_lock_is_removed(locked, capsys):
    assert main(["unlock", str(locked)]) == 0
    assert "removed" in capsys.readouterr().out
    assert main(["unlock", str(locked)]) == 0
    assert "not locked" in capsys.readouterr().out


def test_the_lock_of_a_process_that_works_there_is_kept(locked, capsys):
    code = "import sys; print(flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", code, "snakemake"], cwd=locked, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        other.stdout.readline()
        assert main(["unlock", str(locked)]) == 1
        other.stdin.close()
    assert f"process {other.pid}" in capsys.readouterr().err
    assert (locked / ".snakemake/locks").exists()


def test_without_being_asked_a_lock_is_removed_only_with_yes(locked, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO())
    with pytest.raises(VidtrackError, match="vidtrack unlock"):
        free_lock(str(locked), yes=False)
    free_lock(str(locked), yes=True)
    assert not (locked / ".snakemake/locks").exists()


@pytest.mark.parametrize(("answer", "removed"), [("y\n", True), ("\n", True), ("n\n", False)])
def test_on_a_terminal_it_is_asked_whether_a_stale_lock_may_go(locked, monkeypatch, capsys, answer, removed):
    stdin = io.StringIO(answer)
    stdin.isatty = lambda: True
    monkeypatch.setattr("sys.stdin", stdin)
    if removed:
        free_lock(str(locked), yes=False)
    else:
        with pytest.raises(VidtrackError, match="vidtrack run --yes"):
            free_lock(str(locked), yes=False)
    assert "no process of this computer works there" in capsys.readouterr().out
    assert (locked / ".snakemake/locks").exists() != removed

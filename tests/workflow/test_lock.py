import subprocess
import sys

from vidtrack.workflow.lock import is_locked, why_locked


def test_a_lock_is_seen(tmp_path):
    assert not is_locked(str(tmp_path))
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    assert not is_locked(str(tmp_path))
    (tmp_path / ".snakemake/locks/0.input.lock").write_text("runs/a.mov")
    assert is_locked(str(tmp_path))


def test_a_lock_of_a_killed_one_is_told_from_that_of_one_at_work(tmp_path):
    assert "--unlock" in why_locked(str(tmp_path))
    code = "import sys; print(flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", code, "snakemake"], cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        other.stdout.readline()
        said = why_locked(str(tmp_path))
        other.communicate(b"")
    assert f"(process {other.pid})" in said
    assert "--unlock" not in said
    assert len(said.splitlines()) == 1

import json
import os
import subprocess
import sys

import pytest

from vidtrack.workflow import lock
from vidtrack.workflow.lock import free_of_killed, is_locked, killed_holder, note_holder, why_locked


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


@pytest.fixture
def locked(tmp_path):
    """A folder that a process has locked, and has ended since."""
    (tmp_path / ".snakemake/locks").mkdir(parents=True)
    (tmp_path / ".snakemake/locks/0.input.lock").write_text("runs/a.mov")
    code = f"from vidtrack.workflow.lock import note_holder; note_holder({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ | {"PYTHONPATH": os.getcwd()})
    return tmp_path


def holder(folder, **changes):
    path = folder / ".snakemake/locks" / lock.HOLDER
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_a_lock_of_a_process_that_is_gone_is_taken_away_once_and_snakemake_can_lock_again(locked):
    process = killed_holder(str(locked))
    assert free_of_killed(str(locked)) == process
    assert (locked / ".snakemake/locks").is_dir()
    assert not is_locked(str(locked))
    assert free_of_killed(str(locked)) is None
    assert [path.name for path in (locked / ".snakemake").iterdir()] == ["locks"]


def test_a_lock_of_a_process_at_work_stays(locked):
    note_holder(str(locked))
    assert free_of_killed(str(locked)) is None
    assert is_locked(str(locked))


def test_a_number_that_another_process_has_now_is_not_that_of_the_holder(locked):
    holder(locked, process=os.getpid())
    assert killed_holder(str(locked)) == os.getpid()


def test_a_computer_that_was_started_again_runs_no_holder_of_before(locked):
    note_holder(str(locked))
    holder(locked, boot="another")
    assert killed_holder(str(locked)) == os.getpid()


@pytest.mark.parametrize(
    "changes",
    [{"host": "another"}, {"machine": "another"}, {"machine": ""}, {"processes": "another"}, {"started": None}],
)
def test_a_lock_from_elsewhere_stays(locked, changes):
    holder(locked, **changes)
    assert free_of_killed(str(locked)) is None
    assert is_locked(str(locked))


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"process": "a"}'])
def test_a_lock_of_which_it_is_not_known_who_holds_it_stays(locked, text):
    (locked / ".snakemake/locks" / lock.HOLDER).write_text(text)
    assert free_of_killed(str(locked)) is None
    assert is_locked(str(locked))

"""Jobs that are forked by a server that has loaded the libraries, and what happens when one of the two is killed."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from vidtrack.workflow import small_jobs
from vidtrack.workflow.job_server import load
from vidtrack.workflow.small_jobs import SERVER, JobServer

HOUSE = str(Path(small_jobs.__file__).parents[2])

JOB = """
import os, sys, time
def run(job):
    asked = job.settings
    with open("started", "w") as file:
        file.write(str(os.getpid()))
    if asked.get("wants"):
        print(asked["wants"] in sys.modules)
        __import__(asked["wants"])
    if asked.get("warns"):
        import warnings
        warnings.warn("odd")
    if asked.get("leaves"):
        os.environ["COLOUR"], sys.argv = "red", []
        os.umask(0o77)
        os.mkdir("elsewhere")
        os.chdir("elsewhere")
    if asked.get("wait"):
        time.sleep(60)
    print(os.environ["COLOUR"], os.getcwd(), sys.stdin.read() == "", flush=True)
    with open(job.outputs["table"], "w") as file:
        file.write("numbers")
"""

PRETENDED = """
import sys, types
pretended = types.ModuleType("vidtrack.jobs.pretended")
exec({job!r}, pretended.__dict__)
sys.modules["vidtrack.jobs.pretended"] = pretended
"""

SERVED = (
    PRETENDED
    + """
from vidtrack.workflow import job_server
job_server.LIBRARIES = ()
job_server.main(sys.argv[1], int(sys.argv[2]))
"""
)

CALLED = (
    PRETENDED
    + """
from vidtrack.workflow.small_jobs import run_by_server
from vidtrack.workflow.entry import main
code = run_by_server(sys.argv[1:])
if code is None:
    print("in a process of its own")
    code = main(sys.argv[1:])
sys.exit(code)
"""
)


class Served:
    """A server that knows one more rule, and calls of it."""

    def __init__(self, folder, snakemake):
        self.folder, place = folder, folder / "jobs"
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind(str(place))
            listener.listen()
            self.process = subprocess.Popen(
                [sys.executable, "-c", SERVED.format(job=JOB), str(place), str(listener.fileno())],
                env=os.environ | {"PYTHONPATH": HOUSE},
                stdin=subprocess.PIPE,
                text=True,
                pass_fds=[listener.fileno()],
            )
        self.variable = f"{place}\n{snakemake}\n{small_jobs._this_python()}"
        wait_for(lambda: listens(place))

    def call(self, settings="{}", variable=None, **more):
        command = [sys.executable, "-c", CALLED.format(job=JOB), "pretended", "--output", "table", "table.txt"]
        environment = os.environ | {SERVER: variable or self.variable, "COLOUR": "blue", "PYTHONPATH": HOUSE}
        child = subprocess.Popen(
            command,
            cwd=self.folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **more,
        )
        child.stdin.write(f"{settings}\n{{}}\n{{}}\n")
        child.stdin.close()
        child.stdin = None
        return child

    def job(self):
        """The process of the job that is at work."""
        started = self.folder / "started"
        wait_for(lambda: started.exists() and started.read_text())
        return int(started.read_text())


def listens(place):
    """Whether a server answers there: the socket is there a moment before."""
    with socket.socket(socket.AF_UNIX) as caller:
        return caller.connect_ex(str(place)) == 0


def wait_for(condition):
    until = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def gone(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.fixture
def served(tmp_path):
    server = Served(tmp_path, os.getpid())
    yield server
    server.process.stdin.close()
    server.process.wait(timeout=30)


def test_a_job_that_is_forked_has_the_callers_folder_environment_and_channels(served):
    said, problems = (child := served.call()).communicate(timeout=30)
    assert (child.returncode, said, problems) == (0, f"blue {served.folder} True\n", "")
    assert (served.folder / "table.txt").read_text() == "numbers"
    assert served.job() != child.pid


def test_a_job_that_fails_says_so_through_its_caller(served):
    said, problems = (child := served.call("no JSON")).communicate(timeout=30)
    assert (child.returncode, said) == (1, "")
    assert problems.startswith("vidtrack: pretended: unexpected JSONDecodeError")


def test_one_process_does_a_job_after_another_and_what_one_imported_is_there_for_the_next(served):
    calls = [served.call('{"wants": "colorsys"}').communicate(timeout=30)[0] for _ in range(2)]
    assert [said.split()[0] for said in calls] == ["False", "True"]
    first = served.job()
    served.call().wait(timeout=30)
    assert served.job() == first


def test_a_process_that_did_a_job_badly_ends_and_the_next_knows_what_it_imported(served):
    served.call('{"wants": "colorsys"}').wait(timeout=30)
    first = served.job()
    assert served.call("no JSON").wait(timeout=30) == 1
    wait_for(lambda: not os.path.exists(f"/proc/{first}"))
    said, _ = served.call('{"wants": "colorsys"}').communicate(timeout=30)
    assert said.split()[0] == "True"
    assert served.job() != first


def test_what_a_job_does_to_its_process_is_no_matter_for_the_next(served):
    assert served.call('{"leaves": true, "warns": true}').wait(timeout=30) == 0
    first = served.job()
    os.umask(umask := os.umask(0))
    for _ in range(2):
        said, problems = served.call('{"warns": true}').communicate(timeout=30)
        assert said == f"blue {served.folder} True\n"
        assert problems.count("odd") >= 1
        assert served.job() == first
    assert (served.folder / "table.txt").stat().st_mode & 0o777 == 0o666 & ~umask


def test_what_cannot_be_loaded_before_a_job_is_left_to_it():
    load(["vidtrack.no_such_module", "__main__", "colorsys"])
    assert "colorsys" in sys.modules


def test_a_caller_that_is_killed_takes_its_job_with_it(served):
    child = served.call('{"wait": true}')
    job = served.job()
    child.kill()
    child.communicate(timeout=30)
    wait_for(lambda: gone(job))
    (served.folder / "started").unlink()
    assert served.call().wait(timeout=30) == 0


def test_a_job_that_is_killed_ends_its_caller_as_the_shell_says_it(served):
    child = served.call('{"wait": true}')
    os.kill(served.job(), signal.SIGKILL)
    child.communicate(timeout=30)
    assert child.returncode == 128 + signal.SIGKILL


def test_a_server_that_is_killed_takes_its_jobs_with_it_and_they_are_done_without_it(served):
    child = served.call('{"wait": true}')
    job = served.job()
    (served.folder / "started").unlink()
    served.process.kill()
    served.process.wait(timeout=30)
    again = served.job()
    wait_for(lambda: gone(job))
    assert again == child.pid
    child.kill()
    child.communicate(timeout=30)


def test_no_job_outlives_a_snakemake_that_was_killed(tmp_path):
    snakemake = subprocess.Popen(["sleep", "60"])
    served = Served(tmp_path, snakemake.pid)
    child = served.call('{"wait": true}')
    job = served.job()
    snakemake.kill()
    snakemake.wait(timeout=30)
    served.process.stdin.close()  # as the kernel closes what a killed process held
    said, _ = child.communicate(timeout=30)
    assert (child.returncode, said) == (1, "")
    assert gone(job)
    assert served.process.wait(timeout=30) == 0


def test_ctrl_c_ends_the_job_and_not_the_server(served):
    child = served.call('{"wait": true}', start_new_session=True)
    os.kill(served.job(), signal.SIGINT)
    child.send_signal(signal.SIGINT)
    child.communicate(timeout=30)
    assert child.returncode == 130
    served.process.send_signal(signal.SIGINT)
    served.process.send_signal(signal.SIGTERM)
    (served.folder / "started").unlink()
    assert served.call().wait(timeout=30) == 0


@pytest.mark.parametrize(
    "variable",
    [
        "/nowhere/jobs\n1\n{python}",
        "{place}\n1\n/usr/bin/python3 of a container",
        "",
    ],
)
def test_without_a_server_of_the_same_python_a_job_runs_by_itself(served, variable):
    place = served.variable.split("\n")[0]
    variable = variable.format(python=small_jobs._this_python(), place=place)
    child = served.call(variable=variable or "\n")
    said, _ = child.communicate(timeout=30)
    assert (child.returncode, said) == (0, f"in a process of its own\nblue {served.folder} True\n")
    assert served.job() == child.pid


def test_the_server_of_a_snakemake_ends_with_it_and_leaves_nothing():
    server = JobServer()
    place = os.environ[SERVER].split("\n")[0]
    assert server._process.poll() is None
    server.end()
    assert server._process.returncode in (0, -signal.SIGKILL)  # where the machine was too busy to load the libraries
    assert SERVER not in os.environ
    assert not os.path.exists(os.path.dirname(place))


def test_a_server_that_hears_nothing_is_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(small_jobs, "PATIENCE_S", 0.05)
    server = JobServer.__new__(JobServer)
    server._folder = str(tmp_path / "socket")
    server._process = subprocess.Popen(["sleep", "60"], stdin=subprocess.PIPE)
    server.end()
    assert server._process.returncode == -signal.SIGKILL


def test_a_snakemake_that_was_killed_leaves_no_folder_of_its_server(tmp_path):
    code = "import time\nfrom vidtrack.workflow.small_jobs import JobServer\n"
    code += "server = JobServer()\nprint(flush=True)\ntime.sleep(60)"
    snakemake = subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": HOUSE, "TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
    )
    with snakemake:
        snakemake.stdout.readline()
        (folder,) = tmp_path.glob("vidtrack-*")
        wait_for((folder / "jobs").exists)
        snakemake.kill()
    wait_for(lambda: not folder.exists())
    assert list(tmp_path.iterdir()) == []


def test_a_server_keeps_a_folder_that_holds_more_than_its_socket(served):
    (served.folder / "mine.txt").write_text("kept")
    served.process.stdin.close()
    assert served.process.wait(timeout=30) == 0
    assert [path.name for path in served.folder.iterdir()] == ["mine.txt"]


def test_what_a_server_left_that_was_killed_with_its_snakemake_is_removed(tmp_path):
    for name in ("vidtrack-killed", "vidtrack-at-work", "vidtrack-other", "other"):
        (tmp_path / name).mkdir()
    (tmp_path / "vidtrack-other" / "file").write_text("of a person")
    for name in ("vidtrack-killed", "other"):
        with socket.socket(socket.AF_UNIX) as killed:
            killed.bind(str(tmp_path / name / "jobs"))
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "vidtrack-at-work" / "jobs"))
        listener.listen()
        small_jobs.remove_left(str(tmp_path))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "vidtrack-at-work", "vidtrack-other"]


def test_a_folder_in_which_no_server_began_is_removed_once_it_is_old(tmp_path):
    for name in ("empty___", "new_____", "fresh___", "used____", "of-other"):
        (tmp_path / f"vidtrack-{name}").mkdir(mode=0o700)
    (tmp_path / "vidtrack-thesis__").mkdir(mode=0o755)
    (tmp_path / "vidtrack-used____" / "notes").write_text("dear")
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(tmp_path / "vidtrack-new_____" / "jobs.new"))
    for folder in tmp_path.iterdir():
        os.utime(folder, (0, time.time() if "fresh" in folder.name else time.time() - 2 * small_jobs.BEGINNING_S))
    small_jobs.remove_left(str(tmp_path))
    left = ["vidtrack-fresh___", "vidtrack-of-other", "vidtrack-thesis__", "vidtrack-used____"]
    assert sorted(path.name for path in tmp_path.iterdir()) == left


def test_what_someone_keeps_under_such_a_name_is_never_removed(tmp_path):
    """A connection to what is no socket is refused too."""
    (tmp_path / "vidtrack-mine/jobs").mkdir(parents=True)
    (tmp_path / "vidtrack-mine/jobs/film.mov").write_text("dear")
    (tmp_path / "vidtrack-file").mkdir()
    (tmp_path / "vidtrack-file/jobs").write_text("dear")
    with socket.socket(socket.AF_UNIX) as dead:
        (tmp_path / "vidtrack-dead").mkdir()
        (tmp_path / "vidtrack-dead/notes").write_text("dear")
        dead.bind(str(tmp_path / "vidtrack-dead/jobs"))
    small_jobs.remove_left(str(tmp_path))
    kept = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert kept == ["vidtrack-dead/notes", "vidtrack-file/jobs", "vidtrack-mine/jobs/film.mov"]

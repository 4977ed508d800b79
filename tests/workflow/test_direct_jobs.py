"""Small jobs that Snakemake asks the server for: what is understood of a shell command, and what becomes of the job."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.workflow.test_small_jobs import SERVER, Served, wait_for
from vidtrack.workflow.direct_jobs import (
    WAITING,
    Places,
    ServedJob,
    command_of,
    for_shell_commands,
    measured_by,
    start,
    with_places,
)
from vidtrack.workflow.small_jobs import LARGE

PYTHON = """#!{python}
import json, sys
print(json.dumps([sys.stdin.read(), sys.argv[1:]]))
"""


def command(order, arguments):
    """As Snakemake writes it: each word quoted, two blanks where it has nothing to say."""
    lines, words = (" ".join(map(shlex.quote, some)) for some in (order, arguments))
    return f"set -euo pipefail;  printf '%s\\n' {lines} | python -m vidtrack {words} "


WORD = st.text(st.characters(exclude_characters="\0\r", exclude_categories=["Cs"]), max_size=8)


@settings(max_examples=12)
@given(order=st.lists(WORD, min_size=3, max_size=3), arguments=st.lists(WORD, min_size=1, max_size=4))
def test_a_command_is_understood_as_a_shell_does(tmp_path_factory, order, arguments):
    place = tmp_path_factory.mktemp("bin")
    (place / "python").write_text(PYTHON.format(python=sys.executable))
    (place / "python").chmod(0o755)
    text = command(order, arguments)
    environment = os.environ | {"PATH": f"{place}:{os.environ['PATH']}", "PYTHONUTF8": "1"}
    said = subprocess.run(["bash", "-c", text], env=environment, capture_output=True, check=True).stdout
    read, called = json.loads(said)
    found = command_of(text)
    assert called == ["-m", "vidtrack", *found.arguments]
    assert read == found.order


@pytest.mark.parametrize(
    "more",
    ["; touch x", "&& true", "> x", "| cat", "$HOME", "$(id)", "`id`", "*", "~", "\\ ", "a\nb", '"$HOME"', "'", "#"],
)
def test_what_means_something_to_a_shell_is_left_to_it(more):
    plain = command(["{}"] * 3, ["locate", "--log", "x.log"])
    assert command_of(plain)
    assert command_of(f"{plain} {more}") is None
    assert command_of(plain.replace("x.log", more)) is None


def test_a_command_in_a_file_or_of_another_program_is_left_to_the_shell():
    plain = command(["{}"] * 3, ["locate"])
    for other in ('"/bin/bash" "script.sh"', plain.replace("vidtrack", "snakemake"), plain.replace("'{}'", "", 1), ""):
        assert command_of(other) is None


@pytest.fixture
def served(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    server = Served(tmp_path, os.getpid())
    yield server
    server.process.stdin.close()
    server.process.wait(timeout=30)


def begin(served, order="{}", places=None, **variables):
    environment = os.environ | {SERVER: served.variable, "COLOUR": "blue"} | variables
    text = command([order, "{}", "{}"], ["pretended", "--output", "table", "table.txt"])
    options = {"shell": True, "executable": "/bin/bash", "stderr": subprocess.DEVNULL}
    return start(text, env=environment, places=places or Places(), **options)


def test_the_server_does_the_job_with_the_environment_of_the_command(served, capfd):
    job = begin(served)
    assert isinstance(job, ServedJob)
    assert job.wait() == 0
    assert (served.folder / "table.txt").read_text() == "numbers"
    assert served.job() == job.pid
    assert capfd.readouterr().out == f"blue {served.folder} True\n"


def test_what_a_job_used_is_said_by_the_server_and_nothing_is_sampled(served):
    def sampled(*_):
        raise AssertionError

    record = SimpleNamespace(data_collected=False)
    with measured_by(sampled)((job := begin(served)).pid, record):
        job.wait()
    assert record.data_collected
    assert 0 <= record.cpu_time < 30
    assert record.cpu_usage == pytest.approx(100 * record.cpu_time)
    assert 5 < record.max_rss < 3000
    assert record.running_time > 0


def test_a_process_of_the_shell_is_measured_as_ever():
    @contextmanager
    def sampled(*asked):
        yield asked

    with measured_by(sampled)(12, "record", 30) as found:
        assert found == (12, "record", 30)


def test_a_job_that_fails_and_one_that_is_killed_have_the_exit_codes_of_a_shell(served):
    assert begin(served, "no JSON").wait() == 1
    job = begin(served, '{"wait": true}')
    os.kill(served.job(), signal.SIGKILL)
    assert job.wait() == 128 + signal.SIGKILL


def test_a_job_that_is_ended_is_killed_by_the_server(served):
    job = begin(served, '{"wait": true}')
    served.job()
    job.kill()
    wait_for(lambda: not os.path.exists(f"/proc/{job.pid}"))


def test_without_a_server_and_for_other_commands_the_shell_is_called(served):
    assert isinstance(begin(served, **{SERVER: "/nowhere/jobs\n1\n"}), subprocess.Popen)
    done = start("exit 3", env=dict(os.environ), shell=True)
    assert done.wait() == 3


@pytest.mark.parametrize("rule", LARGE)
def test_a_job_that_decodes_ends_with_its_process(served, rule):
    text = command(["{}"] * 3, [rule, "--help"])
    channels = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    large = start(text, env=os.environ | {SERVER: served.variable}, shell=True, **channels)
    assert isinstance(large, ServedJob)
    assert large.wait() == 0
    wait_for(lambda: not os.path.exists(f"/proc/{large.pid}"))


def test_a_job_whose_server_is_killed_is_tried_once_more_by_the_shell(served, tmp_path):
    tried = tmp_path / "bin"
    tried.mkdir()
    (tried / "python").write_text("#!/bin/sh\ncat > asked-again\nexit 7\n")
    (tried / "python").chmod(0o755)
    job = begin(served, '{"wait": true}', PATH=f"{tried}:{os.environ['PATH']}")
    served.job()
    served.process.kill()
    assert job.wait() == 7
    assert (served.folder / "asked-again").read_text() == '{"wait": true}\n{}\n{}\n'


@pytest.mark.parametrize("ending", ["by itself", "killed", "server killed", "without a server", "not begun"])
def test_a_job_that_finds_no_place_begins_when_one_before_it_ends_however_that_does(served, monkeypatch, ending):
    places, begun = Places(1), []
    if ending == "not begun":
        monkeypatch.setattr("vidtrack.workflow.direct_jobs.ShellJob.__init__", lambda *_, **__: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            begin(served, places=places, **{SERVER: "/nowhere/jobs\n1\n"})
        first = None
    elif ending == "without a server":
        first = begin(served, "no JSON", places, **{SERVER: "/nowhere/jobs\n1\n"})
    else:
        first = begin(served, '{"wait": true}' if "killed" in ending else "{}", places, PATH="/nowhere")
    second = threading.Thread(target=lambda: begun.append(begin(served, places=places, PATH="/nowhere")))
    second.start()
    if first is not None:
        second.join(0.05)
        assert not begun
        if "killed" in ending:
            served.job()
            (first if ending == "killed" else served.process).kill()
        first.wait()
    second.join(30)
    (job,) = begun
    job.wait()


@pytest.mark.parametrize("decoded", [False, True])
def test_snakemake_starts_more_jobs_than_there_are_cores_only_where_none_decodes(decoded):
    rules = ["locate", "kinematics", *(["track"] if decoded else [])]
    jobs = [SimpleNamespace(rule=SimpleNamespace(name=name)) for name in rules]
    dag = SimpleNamespace(needrun_jobs=lambda: jobs)
    scheduler = SimpleNamespace(
        workflow=SimpleNamespace(dag=dag), resources={"_cores": 2}, global_resources={"_cores": 2}
    )
    places = with_places(scheduler, 2)
    assert scheduler.resources == scheduler.global_resources == {"_cores": 2 if decoded else 2 + WAITING}
    taken = threading.Thread(target=lambda: [places.take() for _ in range(3)], daemon=True)
    taken.start()
    taken.join(0.1)
    assert taken.is_alive() is not decoded
    places.leave()
    taken.join(30)
    assert not taken.is_alive()


def test_only_the_modules_that_start_and_measure_commands_can_be_given_others():
    module, benchmark = SimpleNamespace(sp=subprocess), SimpleNamespace(benchmarked=measured_by)
    for_shell_commands(module, benchmark, Places())
    assert benchmark.benchmarked is not measured_by
    assert module.sp.Popen.func is start
    assert module.sp.CalledProcessError is subprocess.CalledProcessError
    assert not isinstance(subprocess.Popen, partial)
    with pytest.raises(AttributeError):
        for_shell_commands(SimpleNamespace(), benchmark, Places())


def test_the_long_page_of_the_calibration_and_what_it_waits_for_are_not_left_for_the_end():
    """Of equal priority they come after all runs, and one core has nothing to do meanwhile."""
    rules = "".join(
        path.read_text() for path in sorted(Path(__file__).parents[2].joinpath("workflow/rules").glob("*.smk"))
    )
    first = re.findall(r"^rule (\w+):\n(?:(?!rule ).*\n)*?    priority: 1\n", rules, re.MULTILINE)
    assert set(first) == {"back_project", "overlay", "report_calibration"}

"""The script of faults finds the server of a Snakemake and those of its workers that are at a job, and kills them."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest

from benchmarks.faults.hits import FAULTS
from benchmarks.faults.processes import at_work, end_of_session, servers, session

PRETENDED = """
import os, signal, sys
for busy in (True, False):
    if not os.fork():
        while busy:
            pass
        signal.pause()
signal.pause()
"""
"""A server with two workers, one of them at a job."""


@pytest.fixture
def running():
    with subprocess.Popen(
        [sys.executable, "-c", PRETENDED, "vidtrack.workflow.job_server"], start_new_session=True
    ) as process:
        for _ in range(500):
            if len(servers(process.pid)[1]) == 2 and len(at_work(process.pid)) == 1:
                break
            time.sleep(0.01)
        yield process
        for pid in session(process.pid):
            os.kill(pid, signal.SIGKILL)


def test_the_worker_that_is_killed_is_the_one_at_work(running, tmp_path):
    assert servers(running.pid)[0] == [running.pid]
    (busy,) = at_work(running.pid)
    assert FAULTS["kill-worker"](running, tmp_path, 0.0, random.Random(1)) == "a worker at work"
    assert _gone(running.pid, busy)
    assert len(servers(running.pid)[1]) == 1


def test_the_server_is_killed_and_not_its_workers(running, tmp_path):
    workers = servers(running.pid)[1]
    assert FAULTS["kill-server"](running, tmp_path, 0.0, random.Random(1)) == "the server, a worker at work"
    assert running.wait(5) == -9
    assert set(session(running.pid)) == set(workers)


def test_every_worker_is_killed_from_when_there_are_some(running, tmp_path, monkeypatch):
    found = servers(running.pid)
    answers = [([], {}), ([], {}), found]
    monkeypatch.setattr("benchmarks.faults.hits.servers", lambda _: answers.pop(0) if answers[1:] else found)
    said = FAULTS["kill-every-worker"](running, tmp_path, 0.03, random.Random(1))
    assert int(said.split()[0]) >= 2
    assert all(_gone(running.pid, pid) for pid in found[1])


def test_processes_that_outlive_their_session_are_told_and_ended(running, monkeypatch):
    monkeypatch.setattr("benchmarks.faults.processes.LONGEST_S", 0.1)
    workers = servers(running.pid)[1]
    running.kill()
    running.wait()
    assert set(end_of_session(running.pid)) == set(workers)
    assert end_of_session(running.pid) == []


def _gone(leader, pid):
    for _ in range(200):
        if pid not in servers(leader)[1]:
            return True
        time.sleep(0.01)
    return False

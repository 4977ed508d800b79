"""A forked process ends with the one that forked it, however that ends, and at once where it has ended before."""

import os
import signal
import subprocess
import sys
import time

import pytest

from vidtrack.parent import die_with

FORKS = """
import os, time
from vidtrack.parent import die_with
parent = os.getpid()
child = os.fork()
if not child:
    die_with(parent)
    print(os.getpid(), flush=True)
time.sleep(60)
"""


def is_there(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="the system is not asked elsewhere")
def test_a_forked_process_is_killed_when_its_parent_is():
    with subprocess.Popen([sys.executable, "-c", FORKS], stdout=subprocess.PIPE, text=True) as parent:
        child = int(parent.stdout.readline())
        assert is_there(child)
        parent.kill()
    until = time.monotonic() + 20
    while is_there(child) and time.monotonic() < until:
        time.sleep(0.02)
    assert not is_there(child)


def test_where_the_parent_has_ended_before_the_process_ends_at_once():
    process = os.fork()
    if not process:
        signal.alarm(20)
        die_with(os.getpid())  # no process is its own parent
        os._exit(7)
    assert os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) == 0

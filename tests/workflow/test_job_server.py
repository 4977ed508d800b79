"""What the server of small jobs says of a worker that ends, and how many jobs a worker is given."""

import os
import socket
import struct

import pytest

from vidtrack.workflow.job_server import Server, Worker
from vidtrack.workflow.small_jobs import LARGE, packed
from vidtrack.workflow.worker import MOST, USED, Request


@pytest.fixture
def server():
    with socket.socket(socket.AF_UNIX) as listener:
        yield Server(listener)


def at_work(server, ends_with):
    """A worker whose process ends at once, and its caller's end of the connection."""
    process = os.fork()
    if not process:
        os._exit(ends_with)
    ours, theirs = socket.socketpair()
    ours.close()
    theirs.close()
    channel, other = socket.socketpair()
    other.close()
    worker = server.workers[channel] = Worker(process, channel)
    server.ready.register(channel, 1)
    caller, waits = socket.socketpair()
    worker.caller, worker.idle = caller, False
    server.ready.register(caller, 1)
    return worker, waits


@pytest.mark.parametrize(("status", "code"), [(0, 1), (3, 3)])
def test_a_job_is_not_done_where_its_process_ended_without_saying_so(server, status, code):
    worker, waits = at_work(server, status)
    server._collect(worker)
    assert USED.unpack(waits.recv(USED.size))[0] == code
    assert waits.recv(1) == b""
    assert not server.workers


def test_a_worker_that_has_done_its_share_is_given_no_more(server, monkeypatch):
    ours, theirs = socket.socketpair()
    worker = server.workers[ours] = Worker(os.getpid(), ours)
    body = b"x"
    channels = list(os.pipe())
    monkeypatch.setattr(server, "_forked", lambda *_: Worker(1, socket.socketpair()[0]))
    for _ in range(MOST):
        assert server._given(Request(body, channels)) is worker
        assert struct.unpack("!I", socket.recv_fds(theirs, 4, 2)[0]) == (1,)
        theirs.recv(1)
        theirs.sendall(USED.pack(0, 1, 1))
        server._collect(worker)
    assert server._given(Request(body, channels)) is not worker


@pytest.mark.parametrize(("rule", "share"), [*((rule, 1) for rule in LARGE), ("locate", MOST)])
def test_a_job_that_decodes_has_a_worker_for_itself_alone(server, monkeypatch, rule, share):
    ours, theirs = socket.socketpair()
    idle = server.workers[ours] = Worker(os.getpid(), ours)
    monkeypatch.setattr(server, "_forked", lambda _, share: Worker(1, socket.socketpair()[0], share))
    body = packed(["18", "/", "{}", "2", rule, "--help", "COLOUR=blue"])
    given = server._given(Request(body, list(os.pipe())))
    assert given.left == share
    assert (given is idle) == (share > 1)
    theirs.close()

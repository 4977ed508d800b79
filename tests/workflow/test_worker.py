"""What a worker understands of a caller, and what it keeps from one job to the next."""

import os
import socket
import struct
from pathlib import Path

import pytest

from vidtrack.workflow import worker
from vidtrack.workflow.small_jobs import packed
from vidtrack.workflow.worker import Asked, asked_in, received


def open_files():
    return len(os.listdir("/proc/self/fd"))


def test_an_order_arrives_whole_however_it_is_cut_into_pieces():
    ours, theirs = socket.socketpair()
    order, strange = '{"a":1}\n{}\n{}\n', "\udcff \n'$(x)"
    body = packed(["18", "/tmp", order, "2", "locate", strange, f"NAME=a=b {strange}", "EMPTY="])
    with ours, theirs:
        socket.send_fds(theirs, [struct.pack("!I", len(body))], [1, 2])
        for byte in body:
            theirs.sendall(bytes([byte]))
        request = received(ours)
        asked = asked_in(request.body)
        assert asked == Asked(18, "/tmp", order, ["locate", strange], {"NAME": f"a=b {strange}", "EMPTY": ""})
        assert len(request.channels) == 2
        request.close()


@pytest.mark.parametrize("sent", [b"", b"\0\0", b"\0\0\0\x09{}"])
def test_a_caller_that_breaks_off_is_no_job_and_leaves_no_file_open(sent):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        before = open_files()
        if sent:
            socket.send_fds(theirs, [sent], [1, 2])
        theirs.shutdown(socket.SHUT_WR)
        with pytest.raises(ValueError, match=r"no job|broke off"):
            received(ours)
        assert open_files() == before


def test_the_most_memory_is_that_of_the_job_and_not_of_one_before_it():
    held = bytearray(64 << 20)
    held[:: 1 << 12] = b"x" * len(held[:: 1 << 12])
    before = worker._most_memory()
    del held
    worker._forget_the_most()
    assert 0 < worker._most_memory() < before - (32 << 10)


def test_lists_of_processes_show_which_job_is_at_work():
    name = Path("/proc/self/comm")
    before = name.read_text()
    try:
        worker._be_called("locate")
        assert name.read_text() == "locate\n"
    finally:
        name.write_text(before)


def test_an_order_that_no_caller_writes_is_refused():
    with pytest.raises(ValueError, match="unpack"):
        asked_in(b"18")

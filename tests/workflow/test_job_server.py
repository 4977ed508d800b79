"""What a server of jobs understands of a caller."""

import os
import socket
import struct

import pytest

from vidtrack.workflow.job_server import Asked, received
from vidtrack.workflow.small_jobs import packed


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
        asked, channels = received(ours)
        assert asked == Asked(18, "/tmp", order, ["locate", strange], {"NAME": f"a=b {strange}", "EMPTY": ""})
        assert len(channels) == 2
        for channel in channels:
            os.close(channel)


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

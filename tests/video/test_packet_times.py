"""Time stamps of containers that only count: right again behind a hole, by place and size."""

from types import SimpleNamespace as Thing

import pytest

from vidtrack.video.packet_times import FARTHEST, HEADER, retimer

SIZES = [100, 110, 120, 130, 140, 150, 160, 170]


def chunks(sizes=SIZES, begin=1000):
    """Packets of an AVI as they follow each other, and the entries of its index."""
    packets, entries, at = [], [], begin
    for k, size in enumerate(sizes):
        packets.append(Thing(pos=at, size=size, pts=k, dts=k, is_keyframe=True))
        entries.append(Thing(pos=at - HEADER, timestamp=k, size=size))
        at += size + size % 2 + HEADER
    return packets, Thing(index_entries=entries)


def avi(stream):
    return retimer(Thing(format=Thing(name="avi"), name="/dev/null"), stream)


def recounted(packets):
    """The packets as a demuxer counts them when some before them were not found."""
    for k, packet in enumerate(packets):
        packet.pts = packet.dts = k
    return packets


def stamps(correct, packets):
    told = [correct(packet) for packet in packets]
    return [packet.pts for packet in packets], told


def test_an_undamaged_file_is_left_as_it_is():
    packets, stream = chunks()
    assert stamps(avi(stream), packets) == (list(range(8)), [""] * 8)


@pytest.mark.parametrize("lost", [{3}, {2, 3}, {1, 5}, {6}])
def test_behind_lost_chunks_the_index_says_which_frame_it_is(lost):
    packets, stream = chunks()
    left = recounted([p for k, p in enumerate(packets) if k not in lost])
    right = [k for k in range(8) if k not in lost]
    assert stamps(avi(stream), left)[0] == right
    assert [p.dts for p in left] == right


@pytest.mark.parametrize("cut", [40, 4096])
def test_behind_bytes_that_are_missing_or_too_many_the_sizes_say_which_frame_it_is(cut):
    packets, stream = chunks()
    left = recounted([p for k, p in enumerate(packets) if k != 3])
    for packet in left[3:]:
        packet.pos += cut
    found, told = stamps(avi(stream), left)
    assert found == [0, 1, 2, 4, 5, 6, 7]
    assert told == [""] * 7


def test_a_chunk_that_the_index_does_not_know_is_said():
    packets, stream = chunks()
    left = recounted([packets[0], packets[1], Thing(pos=9000, size=999, pts=2, dts=2), packets[4]])
    found, told = stamps(avi(stream), left)
    assert told[2] == "a chunk that is not in the file's index"
    assert found == [0, 1, 2, 4]


def test_a_chunk_is_looked_for_no_farther_ahead_than_it_may_be():
    packets, stream = chunks([100] + [102] * (FARTHEST + 5) + [77])
    left = recounted([packets[0], packets[-1]])
    left[1].pos += 6
    assert stamps(avi(stream), left)[1][1] == "a chunk that is not in the file's index"


def test_a_packet_without_a_count_of_its_own_keeps_none():
    packets, stream = chunks()
    left = [p for k, p in enumerate(packets) if k != 3]
    left[4].pts = left[4].dts = None
    correct = avi(stream)
    assert [correct(p) for p in left] == [""] * 7
    assert left[4].pts is None


def test_a_raw_dv_packet_s_place_is_its_time():
    correct = retimer(Thing(format=Thing(name="dv")), None)
    packet = Thing(pos=120_000 * 7, size=120_000, duration=1001, pts=3 * 1001)
    assert correct(packet) == ""
    assert packet.pts == 7 * 1001


def test_other_containers_state_their_times_themselves():
    packet = Thing(pos=1, size=1, pts=5, dts=5)
    assert retimer(Thing(format=Thing(name="mov,mp4")), None)(packet) == ""
    assert packet.pts == 5

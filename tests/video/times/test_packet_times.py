"""Time stamps of containers that only count: right again behind a hole, by place and size."""

from fractions import Fraction
from types import SimpleNamespace as Thing

import pytest

from vidtrack.video.times.packet_times import (
    FARTHEST,
    HEADER,
    SLIPS,
    SPOILT,
    Forward,
    Shown,
    coded_stamps,
    retimer,
    with_next,
)

SIZES = [100, 110, 120, 130, 140, 150, 160, 170]


def chunks(sizes=SIZES, begin=1000):
    """Packets of an AVI as they follow each other, and the entries of its index."""
    packets, entries, at = [], [], begin
    for k, size in enumerate(sizes):
        packets.append(Thing(pos=at, size=size, pts=k, dts=k, is_keyframe=True))
        entries.append(Thing(pos=at - HEADER, timestamp=k, size=size))
        at += size + size % 2 + HEADER
    return packets, Thing(index_entries=entries, frames=len(entries))


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


@pytest.mark.parametrize("spoilt", [8, 7])
def test_a_chunk_whose_next_byte_is_spoilt_may_be_spoilt_itself_and_a_later_one_cannot(tmp_path, spoilt):
    """The header of the fourth chunk is zeros from its first byte on, or from its second."""
    packets, stream = chunks(begin=HEADER)
    data = bytearray(packets[-1].pos + packets[-1].size)
    for packet in packets:
        data[packet.pos - HEADER : packet.pos] = b"00dc" + packet.size.to_bytes(4, "little")
    data[packets[3].pos - spoilt : packets[3].pos] = bytes(spoilt)
    (tmp_path / "a.avi").write_bytes(data + b"idx1" + bytes(8))
    correct = retimer(Thing(format=Thing(name="avi"), name=str(tmp_path / "a.avi")), stream)
    left = recounted([packet for k, packet in enumerate(packets) if k != 3])
    told = [(packet.pts, *wrong) for packet, *wrong in with_next(((p, correct(p)) for p in left), "avi")]
    expected = SPOILT if spoilt == 8 else ""
    assert told == [(k, expected if k == 2 else "", "") for k in (0, 1, 2, 4, 5, 6, 7)]


def avi_file(packets, path, *, lost=None, cut=(0, 0), index=True):
    """An AVI of these packets: without a chunk, without bytes; with the index of the whole one. And what is read."""
    data, entries = bytearray(HEADER), bytearray()
    for packet in packets:
        entries += b"00dc" + bytes(4) + (packet.pos - HEADER).to_bytes(4, "little") + packet.size.to_bytes(4, "little")
        data[packet.pos - HEADER : packet.pos] = b"00dc" + packet.size.to_bytes(4, "little")
        data += bytes(packet.size + packet.size % 2)
    data = data[: cut[0]] + data[cut[1] :]
    path.write_bytes(data + (b"idx1" + len(entries).to_bytes(4, "little") + entries if index else b""))
    left = recounted([packet for k, packet in enumerate(packets) if k != lost])
    for packet in left:
        packet.pos -= cut[1] - cut[0] if packet.pos > cut[1] else 0
    made_up = [Thing(pos=p.pos - HEADER, timestamp=p.pts, size=p.size) for p in left[:5]]
    stream = Thing(index_entries=made_up, frames=len(packets))
    return stamps(retimer(Thing(format=Thing(name="avi"), name=str(path)), stream), left)


def test_behind_bytes_that_are_missing_the_file_s_own_index_says_which_frame_it_is(tmp_path):
    """libavformat makes up an index of what it read: all behind the hole came a frame too early, without a word."""
    packets, _ = chunks(range(120, 132), begin=2 * HEADER)
    cut = packets[3].pos - 30, packets[3].pos + 40
    found, told = avi_file(packets, tmp_path / "a.avi", lost=3, cut=cut)
    assert found == [0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11]
    assert any(told[2:4])
    assert not any(told[4:])


def test_empty_chunks_in_a_file_without_an_index_are_pictures_that_were_dropped_and_no_damage(tmp_path):
    """VirtualDub writes them, and no index if it ends early: all pictures behind the first one were called damaged."""
    data, packets = bytearray(HEADER), []
    for k in range(12):
        size = 120 + 2 * k
        packets.append(Thing(pos=len(data) + HEADER, size=size, pts=2 * k, dts=2 * k, is_keyframe=True))
        data += b"00dc" + size.to_bytes(4, "little") + bytes(size) + b"00dc" + bytes(4)
    (tmp_path / "a.avi").write_bytes(data)
    made_up = [Thing(pos=p.pos - HEADER, timestamp=p.pts, size=p.size) for p in packets[:2]]
    correct = retimer(
        Thing(format=Thing(name="avi"), name=str(tmp_path / "a.avi")), Thing(index_entries=made_up, frames=24)
    )
    found, told = stamps(correct, packets)
    assert found == list(range(0, 24, 2))
    assert not any(told)


def test_of_chunks_of_one_size_that_one_is_taken_whose_followers_fit(tmp_path):
    """Four of eight chunks are missing, and the first behind them lies nearer to another one of its size."""
    packets, _ = chunks([120, 100, 120, 110, 120, 130, 140, 150], begin=2 * HEADER)
    data = bytearray(packets[-1].pos + packets[-1].size)
    entries = [Thing(pos=p.pos - HEADER, timestamp=k, size=p.size) for k, p in enumerate(packets)]
    left = recounted([packet for k, packet in enumerate(packets) if k in (0, 4, 5, 6, 7)])
    for packet in left:
        packet.pos -= 250 if packet.pos > packets[0].pos else 0
        data[packet.pos - HEADER : packet.pos] = b"00dc" + packet.size.to_bytes(4, "little")
    (tmp_path / "a.avi").write_bytes(data)
    stream = Thing(index_entries=entries, frames=8)
    found, _ = stamps(retimer(Thing(format=Thing(name="avi"), name=str(tmp_path / "a.avi")), stream), left)
    assert found == [0, 4, 5, 6, 7]


def test_behind_bytes_that_are_missing_in_a_file_without_an_index_nothing_is_sure(tmp_path):
    packets, _ = chunks([120] * 12, begin=2 * HEADER)
    cut = packets[3].pos - 30, packets[3].pos + 40
    _, told = avi_file(packets, tmp_path / "a.avi", lost=3, cut=cut, index=False)
    assert all(told[3:])
    packets, _ = chunks([120] * 12, begin=2 * HEADER)
    assert avi_file(packets, tmp_path / "whole.avi", index=False) == (list(range(12)), [""] * 12)


def test_pictures_are_shown_when_the_packets_that_bring_them_out_are_decoded():
    """I P b b with stamps of decoding alone, of a decoder that holds two: as AVI gives them."""
    given = [Thing(pts=5, dts=6), Thing(pts=7, dts=7), Thing(pts=8, dts=8), Thing(pts=6, dts=None)]
    shown = Shown(given[0])
    assert [shown(picture) for picture in given] == [5, 6, 7, None]
    assert [Shown(Thing(pts=None, dts=4))(picture) for picture in given[:2]] == [6, 7]


@pytest.mark.parametrize(
    ("container", "alone", "so"), [("avi", False, True), ("avi", True, False), ("mov,mp4", False, False)]
)
def test_stamps_are_those_of_decoding_in_avi_where_pictures_may_change_places(container, alone, so):
    assert coded_stamps(Thing(format=Thing(name=container)), Thing(codec=Thing(intra_only=alone))) == so


def moved_on(times, *, guessed=True, damaged=False):
    forward = Forward(Fraction(1), guessed=guessed)
    given = [forward(Fraction(time), damaged=damaged) for time in times]
    return [int(time) for time, _ in given], [i for i, (_, wrong) in enumerate(given) if wrong]


def test_stamps_that_fall_back_by_a_few_pictures_are_counted_on_until_they_agree():
    n = 20 + SLIPS
    times = [*range(n), *range(n - 2, n + 5), n + 7, n + 8]
    assert moved_on(times) == (list(range(n + 9)), [])


@pytest.mark.parametrize(("how", "gap"), [({"guessed": False}, 0), ({"damaged": True}, 0), ({}, 2)])
def test_stamps_that_fall_back_otherwise_are_said_to_be_wrong(how, gap):
    """Where they are the container's own, where damage was found, or where pictures were left out just before."""
    times = [*range(15), *range(15 + gap, 20 + gap), 18, 19, 23]
    assert moved_on(times, **how) == (times, [i for i in (20, 21) if times[i] <= 19 + gap])


def test_stamps_that_fall_back_far_or_for_long_are_not_counted_on():
    assert moved_on([*range(40), 5, 6]) == ([*range(40), 5, 6], [40, 41])
    times, wrong = moved_on([*range(40), *range(30, 60)])
    assert times[: 40 + SLIPS] == list(range(40 + SLIPS))
    assert wrong[0] == 40 + SLIPS

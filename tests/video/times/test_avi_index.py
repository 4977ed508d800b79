import io

import pytest

from vidtrack.video.times.avi_index import HEADER, are_chunks, index_at_end

SIZES = 100, 111, 0, 130


def chunk(name, size):
    return name + size.to_bytes(4, "little") + bytes(size + size % 2)


def file_of(sizes=SIZES, *, begin=24, counted_from=4, more=b""):
    """Pictures with sound behind each, and their index, whose places are counted from any byte."""
    data, entries = bytearray(begin), bytearray()
    for size in sizes:
        for name, length in ((b"00dc", size), (b"01wb", 20), (b"00pc", 4)):
            entries += name + bytes(4) + (len(data) - begin + counted_from).to_bytes(4, "little")
            entries += length.to_bytes(4, "little")
            data += chunk(name, length)
    return io.BytesIO(bytes(data) + b"idx1" + len(entries).to_bytes(4, "little") + bytes(entries) + more)


@pytest.mark.parametrize("counted_from", [4, 24, 2000])
def test_the_chunks_of_pictures_are_those_of_the_file_wherever_their_places_are_counted_from(counted_from):
    chunks = index_at_end(file_of(counted_from=counted_from), 24 + HEADER)
    assert chunks.sizes.tolist() == list(SIZES)
    assert chunks.places.tolist() == [32, 32 + 148, 32 + 148 + 160, 32 + 148 + 160 + 48]


def test_an_index_is_found_behind_bytes_that_are_missing_and_before_others():
    whole = file_of().getvalue()
    cut = io.BytesIO(whole[:60] + whole[90:] + bytes(99))
    assert index_at_end(cut, 32).places.tolist() == index_at_end(io.BytesIO(whole), 32).places.tolist()
    ended = io.BytesIO(whole[:-20])  # within its last entry but one
    assert index_at_end(ended, 32).sizes.tolist() == list(SIZES)


def test_there_is_none_without_its_name_or_of_another_stream():
    whole = file_of().getvalue()
    assert index_at_end(io.BytesIO(whole.replace(b"idx1", b"JUNK")), 32) is None
    assert index_at_end(io.BytesIO(whole.replace(b"00dc\x64", b"xxdc\x64")), 32) is None
    assert index_at_end(io.BytesIO(whole.replace(b"00dc\x64", b"07dc\x64", 1)), 32) is None
    assert index_at_end(io.BytesIO(b""), 32) is None


def test_chunks_and_beginnings_of_lists_are_whole():
    data = chunk(b"01wb", 7) + b"LIST" + (99).to_bytes(4, "little") + b"rec " + chunk(b"JUNK", 4)
    assert are_chunks(io.BytesIO(b"--" + data), 2, 2 + len(data))
    assert are_chunks(io.BytesIO(data), 5, 5)
    assert not are_chunks(io.BytesIO(data), 0, len(data) - 2)
    assert not are_chunks(io.BytesIO(data), 0, len(data) + 8)
    assert not are_chunks(io.BytesIO(data), 2, len(data))

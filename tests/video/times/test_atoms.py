"""Atoms of MP4 and MOV files: sizes of four and eight bytes, to the end of the file, and those that cannot be."""

import io

from vidtrack.video.times.atoms import MOST_ATOMS, atoms


def atom(kind: bytes, contents: bytes, *, long: bool = False) -> bytes:
    if long:
        return (1).to_bytes(4) + kind + (16 + len(contents)).to_bytes(8) + contents
    return (8 + len(contents)).to_bytes(4) + kind + contents


def contents(data: bytes, span=None) -> list[tuple[bytes, bytes]]:
    return [(kind, data[at[0] : at[1]]) for kind, at in atoms(io.BytesIO(data), span)]


def test_atoms_follow_each_other_with_sizes_of_four_and_of_eight_bytes():
    data = atom(b"ftyp", b"qt") + atom(b"mdat", b"abc", long=True) + atom(b"moov", b"")
    assert contents(data) == [(b"ftyp", b"qt"), (b"mdat", b"abc"), (b"moov", b"")]


def test_a_size_of_zero_reaches_to_the_end():
    assert contents(atom(b"ftyp", b"qt") + b"\0\0\0\0mdatrest") == [(b"ftyp", b"qt"), (b"mdat", b"rest")]


def test_the_atoms_of_a_part_are_those_inside_of_it():
    inner = atom(b"trak", b"1") + atom(b"trak", b"22")
    data = atom(b"ftyp", b"qt") + atom(b"moov", inner) + atom(b"free", b"x")
    ((_, span),) = [(kind, at) for kind, at in atoms(io.BytesIO(data)) if kind == b"moov"]
    assert contents(data, span) == [(b"trak", b"1"), (b"trak", b"22")]


def test_an_atom_that_claims_more_than_there_is_ends_with_the_file():
    assert contents((1000).to_bytes(4) + b"moovshort") == [(b"moov", b"short")]


def test_a_size_that_cannot_be_ends_the_reading():
    assert contents(atom(b"ftyp", b"qt") + (7).to_bytes(4) + b"moov" + atom(b"free", b"x")) == [(b"ftyp", b"qt")]
    assert contents((1).to_bytes(4) + b"moov" + (15).to_bytes(8)) == []


def test_a_file_of_empty_atoms_without_end_is_left():
    assert len(contents(atom(b"free", b"") * (MOST_ATOMS + 5))) == MOST_ATOMS

"""The read-out that a camera's maker wrote into a film, from files built byte by byte as the maker describes them."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.video.times.makers_readout import makers_readout


def entry(key, kind, data, size=1):
    """A key, its type, the size of one value, how many, and the values, filled up to four bytes."""
    return struct.pack(">4scBH", key, kind, size, len(data) // size) + data + bytes(-len(data) % 4)


def nested(key, *entries):
    return entry(key, b"\0", b"".join(entries))


def atom(kind, *parts):
    data = b"".join(parts)
    return struct.pack(">I4s", 8 + len(data), kind) + data


def header(ms=20.6, *, up=b"U", stabiliser=b"N", kind=b"f", form=">f"):
    named = [entry(b"MINF", b"c", b"HERO11 Black\0"), entry(b"OREN", b"c", up), entry(b"EISE", b"c", stabiliser)]
    stated = struct.pack(form, ms)
    return nested(b"DEVC", entry(b"DVID", b"L", bytes(4), 4), *named, entry(b"SROT", kind, stated, len(stated)))


def film(path, gpmf, *, at_end=True):
    """A film whose header has these keys."""
    moov = atom(b"moov", atom(b"mvhd", bytes(100)), atom(b"udta", atom(b"FIRM", b"H22"), atom(b"GPMF", gpmf)))
    parts = [atom(b"ftyp", b"mp41" + bytes(4)), *((atom(b"mdat", bytes(5000)), moov) if at_end else (moov,))]
    path.write_bytes(b"".join(parts))
    return str(path)


def film_with_track(path, payload, form=b"gpmd"):
    """A film with a track whose first sample is the payload."""
    start = atom(b"ftyp", b"mp41" + bytes(4))
    stbl = [
        atom(b"stsd", struct.pack(">II", 0, 1), atom(form, bytes(8))),
        atom(b"stsz", struct.pack(">IIII", 0, 0, 1, len(payload))),
        atom(b"stco", struct.pack(">III", 0, 1, len(start) + 8)),
    ]
    trak = atom(b"trak", atom(b"mdia", atom(b"minf", atom(b"stbl", *stbl))))
    path.write_bytes(start + atom(b"mdat", payload) + atom(b"moov", atom(b"mvhd", bytes(100)), trak))
    return str(path)


@pytest.mark.parametrize("at_end", [True, False])
def test_the_header_of_a_film_states_the_read_out(tmp_path, at_end):
    found = makers_readout(film(tmp_path / "a.mp4", header(), at_end=at_end), 1 / 30)
    assert found.ms == pytest.approx(20.6)
    assert found.source == "GoPro's SROT, HERO11 Black"
    assert (found.doubt, found.steady) == ("", True)


def test_an_older_camera_states_it_with_each_payload_of_its_track(tmp_path):
    stated = entry(b"SROT", b"f", struct.pack(">3f", 15.5, 15.6, 15.7), 4)
    payload = nested(b"DEVC", nested(b"STRM", entry(b"ACCL", b"s", bytes(6), 6)), nested(b"STRM", stated))
    assert makers_readout(film_with_track(tmp_path / "a.mp4", payload), 1 / 30).ms == pytest.approx(15.6)
    assert makers_readout(film_with_track(tmp_path / "b.mp4", payload, b"fdsc"), 1 / 30) is None


@pytest.mark.parametrize(
    ("gpmf", "why"),
    [
        (header(0.0206), "no camera"),  # stated in s
        (header(20600.0), "no camera"),
        (header(-20.6), "no camera"),
        (header(float("nan")), "no camera"),
        (header(36.0), "from one picture to the next"),
        (header(up=b"D"), "first row is not known"),
        (header(0.0, kind=b"?"), "no camera"),
    ],
)
def test_what_cannot_be_a_read_out_is_not_used(tmp_path, gpmf, why):
    assert why in makers_readout(film(tmp_path / "a.mp4", gpmf), 1 / 30).doubt


def test_a_picture_that_the_file_turns_counts_its_rows_as_they_were_stored(tmp_path):
    path = film(tmp_path / "a.mp4", header(up=b"D"))
    assert makers_readout(path, 1 / 30, rotation=180).doubt == ""


def test_a_stabiliser_that_was_on_is_known(tmp_path):
    assert makers_readout(film(tmp_path / "a.mp4", header(stabiliser=b"Y")), 1 / 30).steady is False


def test_files_that_say_nothing_of_it_and_files_that_are_no_films_state_none(tmp_path):
    nothing = nested(b"DEVC", entry(b"DVID", b"L", bytes(4), 4))
    assert makers_readout(film(tmp_path / "a.mp4", nothing), 1 / 30) is None
    (tmp_path / "b.png").write_bytes(b"\x89PNG\r\n\x1a\n" + header())
    assert makers_readout(str(tmp_path / "b.png"), 1 / 30) is None
    assert makers_readout(str(tmp_path / "none.mp4"), 1 / 30) is None


WHOLE = header()


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_damage_is_passed_over(tmp_path_factory, data):
    """Bytes changed, a part cut off: an answer, or none, and no crash."""
    path = tmp_path_factory.mktemp("klv") / "a.mp4"
    make = data.draw(st.sampled_from([film, film_with_track]))
    make(path, WHOLE)
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 4))):
        whole[data.draw(st.integers(8, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole)))])
    found = makers_readout(str(path), 1 / 30)
    assert found is None or found.doubt or 1 <= found.ms <= 34


def test_keys_nested_in_each_other_without_end_are_no_crash(tmp_path):
    own = header()
    for _ in range(40):
        own = nested(b"DEVC", own)
    assert makers_readout(film(tmp_path / "a.mp4", own), 1 / 30) is None

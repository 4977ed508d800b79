"""Stills in tiles, as telephones store them, written here box by box; the ball lies across the tiles' borders."""

import struct
from fractions import Fraction

import av
import numpy as np
import pytest

from tests.video.pictures import found, levels
from vidtrack.errors import VidtrackError
from vidtrack.video.random_access import Pictures
from vidtrack.video.reader import open_video
from vidtrack.video.stills.heic_tiles import is_tiled

TILE, ROWS, COLUMNS, SIZE = 64, 2, 3, (181, 121)
PLACES = [(64.2, 63.7), (128.4, 20.3), (100.6, 90.2)]


def box(name, content, version=None, flags=0):
    head = b"" if version is None else struct.pack(">I", version << 24 | flags)
    return struct.pack(">I4s", 8 + len(head) + len(content), name.encode()) + head + content


def ball(x, y, bits):
    from tests.files.clips import ball as soft

    picture = soft(COLUMNS * TILE, ROWS * TILE, x, y) * (2**bits - 1) / 255
    return np.rint(picture).astype(np.uint8 if bits == 8 else np.uint16)


def coded(tile, bits, folder, kind="hvc1"):
    """hvcC, or av1C, and the sample of a tile."""
    from tests.files.clips import same_priority, video_frame

    path, pix_fmt = folder / "tile.mkv", "yuv420p" if bits == 8 else "yuv420p10le"
    with same_priority(), av.open(str(path), "w") as out:
        stream = out.add_stream("libx265" if kind == "hvc1" else "libsvtav1", rate=Fraction(25))
        stream.width, stream.height, stream.pix_fmt = TILE, TILE, pix_fmt
        lossless = {"x265-params": "lossless=1:bframes=0:log-level=none:info=0"}
        stream.options = lossless if kind == "hvc1" else {"crf": "1"}
        # x265 reckons the time of the first pictures with a delay that one picture alone never sets
        out.mux(stream.encode(video_frame(tile, pix_fmt)))
        out.mux(stream.encode())
    with av.open(str(path)) as back:
        stream = back.streams.video[0]
        return bytes(stream.codec_context.extradata), b"".join(bytes(p) for p in back.demux(stream) if p.size)


def heic(folder, picture, bits=8, turns=(), *, idat=True, size=SIZE, missing=0, kind="hvc1"):
    """A HEIC whose primary item is a grid; turns: (irot or imir, value) of it."""
    tiles = [
        coded(np.ascontiguousarray(picture[r * TILE : (r + 1) * TILE, c * TILE : (c + 1) * TILE]), bits, folder, kind)
        for r in range(ROWS)
        for c in range(COLUMNS)
    ]
    setup, samples = tiles[0][0], [sample for _, sample in tiles]
    n = len(samples)
    grid = struct.pack(">BBBBHH", 0, 0, ROWS - 1, COLUMNS - 1, *size)
    infe = b"".join(box("infe", struct.pack(">HH4sB", k + 1, 0, kind.encode(), 0), 2, 1) for k in range(n))
    infe += box("infe", struct.pack(">HH4sB", n + 1, 0, b"grid", 0), 2)
    iref = box("dimg", struct.pack(f">HH{n}H", n + 1, n, *range(1, n + 1)))
    ispe = box("ispe", struct.pack(">II", TILE, TILE), 0), box("ispe", struct.pack(">II", *size), 0)
    ipco = (
        box("hvcC" if kind == "hvc1" else "av1C", setup)
        + ispe[0]
        + ispe[1]
        + b"".join(box(name, bytes([value])) for name, value in turns)
    )
    ipma = b"".join(struct.pack(">HBBB", k + 1, 2, 0x81, 2) for k in range(n))
    ipma += struct.pack(">HBB", n + 1, 1 + len(turns), 3) + bytes(0x84 + k for k in range(len(turns)))
    props = box("iprp", box("ipco", ipco) + box("ipma", struct.pack(">I", n + 1) + ipma, 0))

    def meta(start):
        places, at = [], start
        for k, sample in enumerate(samples):
            places.append(struct.pack(">HHHHII", k + 1, 0, 0, 1, at, len(sample)))
            at += len(sample)
        where = (1, 0) if idat else (0, at)
        places.append(struct.pack(">HHHHII", n + 1, where[0], 0, 1, where[1], len(grid)))
        iloc = box("iloc", struct.pack(">BBH", 0x44, 0, n + 1) + b"".join(places), 1)
        hdlr = box("hdlr", bytes(4) + b"pict" + bytes(13), 0)
        pitm = box("pitm", struct.pack(">H", n + 1), 0)
        parts = hdlr + pitm + box("iinf", struct.pack(">H", n + 1) + infe, 0) + box("iref", iref, 0) + props
        return box("meta", parts + (box("idat", grid) if idat else b"") + iloc, 0)

    head = box("ftyp", b"heic" + bytes(4) + b"mif1heic")
    start = len(head) + len(meta(0)) + 8
    data = head + meta(start) + box("mdat", b"".join(samples) + (b"" if idat else grid))
    path = folder / "cam1.heic"
    path.write_bytes(data[: len(data) - missing])
    return path


def shown(x, y, turns):
    """Where a place lies after the turns, and the size."""
    width, height = SIZE
    for name, value in turns:
        for _ in range(value if name == "irot" else 0):
            x, y, width, height = y, width - 1 - x, height, width
        if name == "imir":
            x, y = (width - 1 - x, y) if value else (x, height - 1 - y)
    return (x, y), (width, height)


@pytest.mark.parametrize("bits", [8, 10])
@pytest.mark.parametrize("place", PLACES)
def test_the_ball_is_where_it_was_drawn_across_the_tiles(tmp_path, bits, place):
    path = heic(tmp_path, ball(*place, bits), bits, idat=bits == 8)
    assert is_tiled(str(path))
    with open_video(str(path)) as video:
        assert (video.info.width, video.info.height, video.info.bits, video.info.is_still) == (*SIZE, bits, True)
        (frame,) = list(video.frames())
        assert video.account.problems == ()
    assert np.hypot(*np.subtract(found(frame.luma), place)) < 0.05
    np.testing.assert_array_equal(frame.luma, ball(*place, bits)[: SIZE[1], : SIZE[0]])
    np.testing.assert_array_equal(Pictures(str(path)).picture(0), frame.luma)


@pytest.mark.parametrize(
    "turns",
    [[("irot", 1)], [("irot", 2)], [("irot", 3)], [("imir", 0)], [("imir", 1)], [("irot", 1), ("imir", 1)],
     [("imir", 0), ("irot", 3)]],
    ids=str,
)  # fmt: skip
def test_it_is_turned_as_its_properties_ask(tmp_path, turns):
    path = heic(tmp_path, ball(64.2, 30.7, 8), turns=turns)
    where, size = shown(64.2, 30.7, turns)
    with open_video(str(path)) as video:
        assert (video.info.width, video.info.height) == size
        luma = next(video.frames()).luma
    assert np.hypot(*np.subtract(found(luma), where)) < 0.05


@pytest.mark.parametrize("bits", [8, 10])
def test_tiles_of_av1_are_put_together_too(tmp_path, bits):
    place = PLACES[0]
    path = heic(tmp_path, ball(*place, bits), bits, kind="av01").rename(tmp_path / "cam1.avif")
    with open_video(str(path)) as video:
        assert (video.info.width, video.info.height, video.info.bits, video.info.codec) == (*SIZE, bits, "av1")
        (frame,) = list(video.frames())
    assert np.hypot(*np.subtract(found(frame.luma), place)) < 0.05
    assert np.abs(frame.luma.astype(int) - ball(*place, bits)[: SIZE[1], : SIZE[0]]).max() < 12 * 2 ** (bits - 8)


def test_numbered_stills_in_tiles_are_a_recording(tmp_path):
    for k, place in enumerate(PLACES):
        heic(tmp_path, ball(*place, 8)).rename(tmp_path / f"cam1_{k}.heic")
    with open_video(str(tmp_path / "cam1_0.heic"), numbered=True, rate=5) as video:
        assert [found(frame.luma) for frame in video.frames()] == [pytest.approx(p, abs=0.05) for p in PLACES]


def test_one_that_is_cut_off_or_does_not_cover_itself_is_refused(tmp_path):
    for how in ({"missing": 200}, {"size": (400, 300)}):
        path = heic(tmp_path, ball(*PLACES[0], 8), **how)
        with pytest.raises(VidtrackError, match=r"cam1\.heic: "), open_video(str(path)) as video:
            assert video.account.problems == ()
            next(video.frames())


@pytest.mark.parametrize("at", range(0, 700, 23))
def test_damage_in_its_boxes_is_refused_in_one_line_or_does_no_harm(tmp_path, at, monkeypatch):
    path = tmp_path / "a.heic"
    if not (kept := tmp_path.parent / "whole.heic").exists():
        kept.write_bytes(heic(tmp_path, levels(3, size=(COLUMNS * TILE, ROWS * TILE))).read_bytes())
    data = bytearray(kept.read_bytes())
    data[at : at + 4] = b"\xff\xff\xff\xff"
    path.write_bytes(data)
    try:
        with open_video(str(path)) as video:
            list(video.frames())
        said = ""
    except VidtrackError as error:
        said = str(error)
    assert "\n" not in said

import struct
from contextlib import suppress

import ezc3d
import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.c3d import read


def positions(k=30, n=3):
    p = np.random.default_rng(0).uniform(-500, 500, (k, n, 3)).astype(np.float32)
    p[4:7, 1] = np.nan
    return p


def written(path, p, unit="mm", names=("a", "b é", "c")):
    """A file that ezc3d wrote."""
    own = ezc3d.c3d()
    own["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    own["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    own["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    own["data"]["points"] = np.concatenate([np.moveaxis(p, (0, 1, 2), (2, 1, 0)), np.ones((1, p.shape[1], len(p)))])
    own.write(str(path))
    return path


def test_points_that_ezc3d_wrote_are_read_as_ezc3d_reads_them(tmp_path):
    path = written(tmp_path / "a.c3d", positions())
    found = read(path)
    theirs = np.moveaxis(ezc3d.c3d(str(path))["data"]["points"][:3], (0, 1, 2), (2, 1, 0))
    np.testing.assert_array_equal(found.p, theirs)
    np.testing.assert_array_equal(found.p, positions())
    assert found.names == ("a", "b é", "c")
    assert (found.unit, found.start_s) == ("mm", None)
    assert found.time_s[1] == pytest.approx(0.01)


@pytest.mark.parametrize(("processor", "order"), [(84, "<"), (86, ">"), (85, "dec")])
def test_integers_of_all_processors_are_read(tmp_path, processor, order):
    """A file by hand, after the guide: two points, three frames, scale 0.05."""
    p = np.array([[[10.0, -20, 30], [1, 2, 3]]] * 3) + np.arange(3)[:, None, None]
    end = "<" if order == "dec" else order

    def real(value):
        if order != "dec":
            return struct.pack(order + "f", value)
        raw = struct.pack("<f", value * 4)
        return raw[2:] + raw[:2]

    def parameter(group, name, kind, sizes, data):
        body = struct.pack("bB", kind, len(sizes)) + bytes(sizes) + data + b"\0"
        head = struct.pack("bb", len(name), group) + name
        return head + struct.pack(end + "H", 2 + len(body)) + body

    block = bytes([1, 0x50, 1, processor])
    block += struct.pack("bb", 5, -1) + b"POINT" + struct.pack(end + "H", 3) + b"\0"
    block += parameter(1, b"SCALE", 4, [], real(0.05)) + parameter(1, b"RATE", 4, [], real(50.0))
    block += parameter(1, b"UNITS", -1, [2], b"mm") + parameter(1, b"DATA_START", 2, [], struct.pack(end + "h", 3))
    header = bytes([2, 0x50]) + struct.pack(end + "HHHHH", 2, 0, 1, 3, 10) + real(0.05) + struct.pack(end + "HH", 3, 0)
    header += real(50.0)
    words = np.concatenate([np.rint(p / 0.05), [[[0], [0]], [[0], [-1]], [[0], [0]]]], -1).astype(end + "i2")
    (tmp_path / "a.c3d").write_bytes(header.ljust(512, b"\0") + block.ljust(512, b"\0") + words.tobytes())
    found = read(tmp_path / "a.c3d")
    expected = p.copy()
    expected[1, 1] = np.nan
    np.testing.assert_allclose(found.p, expected, atol=1e-6)
    assert found.names == ("p1", "p2")


def test_the_time_of_day_that_vidtrack_wrote_is_read(tmp_path):
    path = tmp_path / "a.c3d"
    own = ezc3d.c3d()
    own["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    own["parameters"]["POINT"]["LABELS"]["value"] = ["a"]
    own["data"]["points"] = np.ones((4, 1, 5))
    own.add_parameter("VIDTRACK", "START_TIME_S", ["36055.25"])
    own.write(str(path))
    assert read(path).start_s == 36055.25


@pytest.mark.parametrize("cut", [100, 700, -600])
def test_a_file_that_breaks_off_is_refused_in_one_line(tmp_path, cut):
    path = written(tmp_path / "a.c3d", positions(200))
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(VidtrackError, match="C3D file") as error:
        read(path)
    assert "\n" not in str(error.value)


def test_noise_ends_in_a_line_and_never_in_a_traceback(tmp_path):
    whole = bytearray(written(tmp_path / "a.c3d", positions()).read_bytes())
    rng = np.random.default_rng(0)
    for _ in range(60):
        spoilt = bytearray(whole)
        for place in rng.integers(0, 1500, 12):
            spoilt[place] = int(rng.integers(0, 256))
        (tmp_path / "b.c3d").write_bytes(spoilt)
        with suppress(VidtrackError):
            read(tmp_path / "b.c3d")

"""Files made to harm (bombs, giants, tags, control characters) are refused in a line, soon and in little memory."""

import os
import struct
import zlib

import pytest

from tests.files.folders import problems, spoil
from vidtrack.errors import VidtrackError
from vidtrack.exchange.text import bytes_of
from vidtrack.files.config_file import read_config
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_picks, read_points
from vidtrack.settings.config import settings_from_config
from vidtrack.video.reader import open_video

BOMB = "a: &a [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + i)}: &{chr(98 + i)} [{','.join(['*' + chr(97 + i)] * 10)}]\n" for i in range(9)
)

CONFIG = {"units": "m", "cameras": {"cam1": {"sensor": [8.8, 6.6]}}}


def refused(call, *arguments):
    with pytest.raises(VidtrackError) as caught:
        call(*arguments)
    for line in caught.value.problems:
        assert line.isprintable()
        assert len(line) < 2100
    assert len(caught.value.problems) <= 61
    return caught.value.problems[0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        pytest.param(BOMB, "aliases", id="a bomb of aliases"),
        pytest.param("a: &a [*a]\n", "nested too deep", id="a list that holds itself"),
        pytest.param("a: " + "[" * 3_000, "nested too deep|not valid YAML", id="3,000 brackets"),
        pytest.param("a: !!python/object/apply:os.system ['touch PWNED']\n", "not valid YAML", id="a tag that calls"),
        pytest.param("units: !unknown m\n", "not valid YAML", id="a tag of its own"),
        pytest.param("x: " + "9" * 10_000, "not valid YAML", id="a number of 10,000 digits"),
        pytest.param("units: \x07\n", "not valid YAML", id="a control character"),
        pytest.param("units: m\0\n", "not valid YAML", id="a character 0"),
    ],
)
def test_a_config_made_to_harm_is_refused(tmp_path, monkeypatch, text, says):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config.yaml").write_text(text)
    assert any(part in refused(read_config, "config.yaml") for part in says.split("|"))
    assert not (tmp_path / "PWNED").exists()


@pytest.mark.parametrize(
    "config",
    [
        pytest.param(CONFIG | {"x" * 5_000_000: 1}, id="a key of 5 MB"),
        pytest.param(CONFIG | {"units": "x" * 5_000_000}, id="a value of 5 MB"),
        pytest.param(CONFIG | {f"k{i}": 1 for i in range(20_000)}, id="20,000 unknown keys"),
        pytest.param(CONFIG | {"a\x1b[2J\nvidtrack: all good": 1}, id="a key that clears the terminal"),
        pytest.param(CONFIG | {"cameras": {"a\nb": {"sensr": 1}}}, id="a camera of two lines"),
        pytest.param(CONFIG | {"units": b"m"}, id="bytes"),
    ],
)
def test_settings_made_to_harm_are_refused_in_lines_of_a_readable_length(config):
    assert refused(settings_from_config, config).startswith("config.yaml: ")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("tag,x,y,z\n" + "a" * 10_000_000 + ",1,2,3\n", id="a cell of 10 MB"),
        pytest.param("tag,x,y,z\n1," + "9" * 10_000_000 + ",2,3\n", id="a number of 10 MB"),
        pytest.param('tag,x,y,z\n1,"' + "9\n" * 1_000_000, id="a quote that is never closed"),
        pytest.param("tag,x,y,z," + "a" * 10_000_000 + "\n1,1,2,3,4\n", id="a heading of 10 MB"),
        pytest.param("tag,x,y,z," + ",".join(map(str, range(50_000))) + "\n1,1,2,3\n", id="50,000 columns"),
        pytest.param("tag,x,y,z\n" + "1,a,b,c\n" * 20_000, id="60,000 mistakes"),
        pytest.param("tag,x,y,z\n\x1b[31m1,\x1b[2Jq,2,3\n", id="codes of a terminal"),
        pytest.param("tag,x,y,z\n1\0,1,2,3\n", id="a character 0"),
    ],
)
def test_a_table_made_to_harm_is_refused_by_name(tmp_path, text):
    path = tmp_path / "points.csv"
    path.write_text(text)
    assert refused(read_points, path).startswith(str(path))


def test_a_range_in_a_table_is_a_name_and_not_a_billion_of_them(tmp_path):
    path = tmp_path / "picks.csv"
    path.write_text("camera,tag,Xf,Yf\ncam1,1-999999999,1,2\n")
    assert list(read_picks(path)["tag"]) == ["1-999999999"]


@pytest.mark.parametrize("text", ["[" * 200_000, '{"a":' * 100_000, "9" * 100_000])
def test_a_record_made_to_harm_is_refused(tmp_path, text):
    path = tmp_path / "camera.json"
    path.write_text(text)
    assert refused(read_json, str(path)).startswith(str(path))


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


@pytest.mark.parametrize(("width", "height"), [(100_000, 100_000), (20_000, 20_000), (1, 2**31 - 1)])
def test_a_picture_that_unfolds_to_a_giant_is_refused(tmp_path, width, height):
    path = tmp_path / "cam1.png"
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    bomb = zlib.compress(bytes(50_000_000), 9)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", bomb) + chunk(b"IEND", b""))

    def read():
        with open_video(str(path)) as video:
            list(video.frames())

    assert refused(read).startswith(str(path))


@pytest.mark.parametrize("place", ["points.csv", "config.yaml", "camera.toml", "cam1.mov"])
@pytest.mark.parametrize("device", [False, True])
def test_a_pipe_or_a_device_in_place_of_a_file_is_refused_and_not_waited_for(tmp_path, place, device):
    path = tmp_path / place
    os.symlink("/dev/zero", path) if device else os.mkfifo(path)
    read = {"points.csv": read_points, "config.yaml": read_config, "camera.toml": bytes_of, "cam1.mov": open_video}
    assert f"{place}: no file but" in refused(read[place], str(path))


@pytest.mark.parametrize("name", ["runs.csv", "calibration/points.csv", "runs/pluck/cam1.MP4", "calibration/cam9.toml"])
def test_a_pipe_in_an_experiment_is_named_before_anything_is_read(folder, name):
    spoil(folder, name) if (folder / name).exists() else None
    os.mkfifo(folder / name)
    assert f"{name}: no file but a pipe or a device. Put the file itself there." in problems()

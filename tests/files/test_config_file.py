import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.config_file import read_config


def refusal(tmp_path, text):
    (tmp_path / "config.yaml").write_text(text)
    with pytest.raises(VidtrackError) as caught:
        read_config(str(tmp_path / "config.yaml"))
    (line,) = caught.value.problems
    return line.replace(str(tmp_path) + "/", "")


def test_a_config_is_read(tmp_path):
    (tmp_path / "config.yaml").write_text("units: in\ncameras: {cam1: {Cx: 256}}\n")
    assert read_config(str(tmp_path / "config.yaml")) == {"units": "in", "cameras": {"cam1": {"Cx": 256}}}


def test_a_syntax_error_is_told_with_its_line(tmp_path):
    assert refusal(tmp_path, "units: in\ncameras:\n  cam1: {Cx: 256\nruns: {}\n").startswith("config.yaml, line 4")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("units: in\ncameras:\n\tcam1: {}\n", "line 3, column 1: a tab"),
        ("units: in\t\ncameras: {cam1: {}}\n", "line 1, column 10: a tab"),
        ("units:\u00a0in\ncameras: {cam1: {}}\n", "line 1, column 7: a space of another kind (U+00A0)"),
    ],
)
def test_a_tab_or_another_space_is_named_where_it_stands(tmp_path, text, says):
    assert refusal(tmp_path, text) == f"config.yaml, {says} stands there. Write plain spaces in its place."


def test_a_colon_without_a_space_is_named_where_it_stands(tmp_path):
    line = refusal(tmp_path, "units:in\ncameras:\n  cam1: {}\n")
    assert line == "config.yaml, line 1: no space follows the colon. Write `units: ...`."
    line = refusal(tmp_path, "units: in\ncameras:\n  cam1:\n    Cx:256\n    Cy: 3\n")
    assert line.startswith("config.yaml, line 4: no space")
    times = "runs:\n  a: {start: 10:00:55:12, videos: {cam1: C:/films/a.mp4}\nunits: in\n"
    assert "no space" not in refusal(tmp_path, times)


def test_a_key_given_twice_is_refused_rather_than_the_last_one_taken(tmp_path):
    line = refusal(tmp_path, "units: in\ncameras:\n  cam1: {}\n  cam2: {}\n  cam1: {Cx: 3}\n")
    assert line.startswith("config.yaml, line 5")
    assert "'cam1' appears twice (also line 3)" in line


@pytest.mark.parametrize(
    ("text", "says"), [("", "empty"), ("- a\n", "holds no settings"), ("just words", "holds no settings")]
)
def test_something_else_than_settings_is_refused(tmp_path, text, says):
    assert says in refusal(tmp_path, text)


def test_a_missing_config_says_what_to_write(tmp_path):
    with pytest.raises(VidtrackError, match="units"):
        read_config(str(tmp_path / "config.yaml"))


def test_an_anchor_may_be_merged_and_overridden(tmp_path):
    (tmp_path / "config.yaml").write_text("a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\n")
    assert read_config(str(tmp_path / "config.yaml"))["b"] == {"x": 1, "y": 3}


@pytest.mark.parametrize("code", ["10:00:00:10", "10:00:00", "10:00:00.5"])
def test_a_time_code_that_yaml_takes_for_a_number_is_to_be_put_in_quotes(tmp_path, code):
    line = refusal(tmp_path, f"units: in\ndetect:\n  start: {code}\n")
    assert line.startswith("config.yaml, line 3, column 10")
    assert f"put it in quotes: '{code}'" in line
    (tmp_path / "config.yaml").write_text(f"detect: {{start: '{code}', end: 00:59:00:00, box: [1_0, 1.5e+1]}}\n")
    assert read_config(str(tmp_path / "config.yaml"))["detect"] == {
        "start": code,
        "end": "00:59:00:00",
        "box": [10, 15.0],
    }


@pytest.mark.parametrize("name", ["yes", "off", "2026-05-01", "1.10", "~"])
def test_a_name_that_yaml_takes_for_something_else_is_to_be_put_in_quotes(tmp_path, name):
    line = refusal(tmp_path, f"units: in\ncameras: {{}}\nruns:\n  {name}: {{}}\n")
    assert line.startswith("config.yaml, line 4, column 3")
    assert f"put it in quotes: '{name}'" in line
    (tmp_path / "config.yaml").write_text(f"runs: {{'{name}': 1, 12: 2}}\n")
    assert list(read_config(str(tmp_path / "config.yaml"))["runs"]) == [name, 12]

import json
import re
from pathlib import Path

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.settings.config import Settings, detect_for, settings_from_config

REPO = Path(__file__).parents[1]
SMALLEST = {"units": "in", "cameras": {"cam1": None, "cam2": {}}}


def refusals(**changes):
    with pytest.raises(VidtrackError) as caught:
        settings_from_config({**SMALLEST, **changes})
    return list(caught.value.problems)


def test_units_and_cameras_are_enough():
    settings = settings_from_config(SMALLEST)
    assert settings.experiment == "."
    assert settings.calibration.refine == "full"
    assert settings.detect.box == (50.0, 50.0)
    assert list(settings.cameras) == ["cam1", "cam2"]


def test_the_contracts_example_is_understood():
    settings = settings_from_config(
        {
            "units": "in",
            "cameras": {"cam1": {"Cx": 256, "Cy": 240.0, "sensor": [8.8, 6.6], "clock": {"offset_s": 0.1}}},
            "detect": {"threshold": 120, "centroid": "binary", "start": "10:00:59:15", "end": 300},
            "calibration": {"sigma": 0.03, "clips": {"row1": {"tags": "1-16", "polarity": "dark"}}},
            "runs": {
                "pluck": {
                    "targets": ["a", "b", "c"],
                    "threshold": 90,
                    "reference": {"time": "time_s", "value": "x_in", "axis": "x", "target": "a"},
                    "bodies": {"float": {"a": [0, 0, 0], "b": [6, 0, 0], "c": [0, 6, 0]}},
                }
            },
        }
    )
    assert settings.calibration.clips["row1"].tags == ("1-16",)
    assert settings.runs["pluck"].bodies["float"].targets["b"] == (6.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("written", "meant"),
    [("1-4", "1-4"), ([1, "a"], "1 a"), ("3, 7-8, left", "3 7-8 left"), (12, "12"), (["1-1", "#1", "01"], "1-1 #1 01")],
)
def test_tags_are_kept_as_they_are_written_until_the_points_are_known(written, meant):
    settings = settings_from_config({**SMALLEST, "calibration": {"clips": {"c": {"tags": written}}}})
    assert settings.calibration.clips["c"].tags == tuple(meant.split())


def test_a_whole_number_and_a_decimal_mean_the_same():
    one = settings_from_config({**SMALLEST, "cameras": {"cam1": {"Cx": 256}}})
    other = settings_from_config({**SMALLEST, "cameras": {"cam1": {"Cx": 256.0}}})
    assert one.model_dump_json() == other.model_dump_json()


@pytest.mark.parametrize("name", ["plück", "P12-B", "1.a_b"])
def test_a_name_is_letters_of_any_alphabet_digits_and_a_few_signs(name):
    assert list(settings_from_config({**SMALLEST, "runs": {name: None}}).runs) == [name]


@pytest.mark.parametrize("name", ["run 1", "-a", ".a", "a/b", ""])
def test_a_name_that_would_make_no_clean_path_is_refused(name):
    assert "a name is made of letters" in refusals(runs={name: None})[0]


def test_a_misspelt_key_names_the_nearest_one_wherever_it_belongs():
    assert refusals(detect={"treshold": 3}) == [
        "config.yaml: detect.treshold: no such setting; did you mean 'threshold'?"
    ]
    assert refusals(cameras={"cam1": {"treshold": 3}}) == [
        "config.yaml: cameras.cam1.treshold: no such setting; did you mean 'threshold'?"
    ]
    assert "did you mean 'calibration'" in refusals(calbration={})[0]
    (line,) = refusals(detect={"sigma": 3})
    assert "detect.sigma: no such setting in this section, but in another one. Move it; known here: " in line
    assert "did you mean" not in line


def test_all_problems_are_told_at_once_each_with_its_place():
    lines = refusals(units="inch", cameras={"cam1": {"Cx": "left"}}, runs={"p": {"targets": 0, "polarity": "drak"}})
    assert [line.split(": ")[1] for line in lines] == ["units", "cameras.cam1.Cx", "runs.p.polarity", "runs.p.targets"]
    assert "did you mean 'in'" in lines[0]
    assert "'left'" in lines[1]


@pytest.mark.parametrize(
    ("word", "unit"),
    [('"', "in"), ("in.", "in"), ("Feet", "ft"), ("metre", "m"), ("in ", "in"), ("incches", "in"), ("milimetre", "mm")],
)
def test_a_unit_is_recognised_by_the_words_that_people_write(word, unit):
    assert refusals(units=word)[0].endswith(f"did you mean {unit!r}?")


def test_a_unit_that_is_not_offered_is_not_taken_for_a_millionfold_one():
    assert not any("did you mean" in refusals(units=word)[0] for word in ("µm", "micron", "kilometre", "kilometr"))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"calibration": {"sigma": "0,01"}}, "Decimals begin with a point: 0.01."),
        ({"calibration": {"sigma": "1 1/32"}}, "Write it as a decimal: 1.03125."),
        ({"calibration": {"sigma": "1 mm"}}, "Write a number alone"),
        (
            {"cameras": {"c": {"sensor": [6, 4, 4, 8]}}},
            "4 entries where 2 are wanted: [6, 4, 4, 8]. Decimals begin with a",
        ),
        ({"cameras": {"c": {"sensor": "6.4 x 4.8"}}}, "takes a list, not '6.4 x 4.8'. Write [6.4, 4.8]."),
        ({"runs": {"r": {"detect": {"start": 1.5}}}}, "takes a whole number, not 1.5."),
        ({"runs": {"r": {"targets": "bow"}}}, "takes a list, not 'bow'. Write [bow]."),
        ({"runs": {"r": {"rate": "120fps"}}}, "Write a number alone"),
        ({"runs": {"r": {"fps": 120}}}, "no such setting; did you mean 'rate'?"),
        ({"runs": {"r": {5: None}}}, "Decimals begin with a point, and in braces a comma ends a setting."),
        ({"cameras": ["cam1", "cam2"]}, "Write `cam1: {}`, and so each of them, on a line of its own."),
        ({"detect": {"threshold": 0.5}}, "a grey level of 255, not a share of it: write 128"),
        ({"runs": {"r": {"targets": "bow, stern"}}}, "takes a list, not 'bow, stern'. Write [bow, stern]."),
    ],
)
def test_a_value_of_another_form_is_answered_with_what_to_write(change, says):
    (line,) = refusals(**change)
    assert says in line
    assert "tuple" not in line
    assert "parse" not in line


def test_where_one_form_fits_the_others_are_not_named():
    assert refusals(runs={"r": {"targets": 0}}) == [
        "config.yaml: runs.r.targets: input should be greater than or equal to 1, not 0."
    ]


def test_a_place_that_allows_several_forms_is_told_of_once():
    assert len(refusals(detect={"threshold": "outo"})) == 1
    assert len(refusals(cameras={"cam1": {"clock": {"ofset_s": 1}}})) == 1


@pytest.mark.parametrize(
    "change",
    [
        {"cameras": {}},
        {"cameras": {"../x": {}}},
        {"cameras": {"c": {"sensor": [8.8, 0]}}},
        {"cameras": {"c": {"Cx": float("nan")}}},
        {"calibration": {"sigma": -1}},
        {"cameras": {"c": {"clock": {"rate_ppm": -1e6}}}},  # time would stand still
        {"cameras": {"c": {"readout_ms": 20000}}},  # us
        {"cameras": {"c": {"readout_ms": 0.016}}},  # s
        {"runs": {"r": {"targets": ["t1", "t2", "t1"]}}},
        {"runs": {"r": {"targets": True}}},
        {"calibration": {"fix": ["kapa1"]}},
        {"calibration": {"prior": {"Cx": [256, 0]}}},
        {"calibration": {"clips": {"r": {"tags": "1,,2"}}}},
        {"detect": {"box": [50]}},
        {"detect": {"threshold": 300}},
        {"runs": {"p": {"bodies": {"f": {"a": [1, 2]}}}}},
    ],
)
def test_values_that_make_no_sense_are_refused(change):
    assert len(refusals(**change)) == 1


def test_a_runs_own_detect_settings_win_in_either_place():
    settings = settings_from_config(
        {**SMALLEST, "detect": {"threshold": 50}, "runs": {"p": {"threshold": 90, "detect": {"min_pixels": 9}}}}
    )
    own = settings.runs["p"]
    merged = detect_for(settings, own, own.detect)
    assert (merged["threshold"], merged["min_pixels"], merged["polarity"]) == (90.0, 9, "bright")


def keys_of_the_schema():
    """Each key of config.yaml with its place in the schema, however deep it stands."""
    schema = Settings.model_json_schema(by_alias=True)
    for name, section in [("", schema), *schema["$defs"].items()]:
        for key, place in section.get("properties", {}).items():
            yield f"{name}.{key}".lstrip("."), place


def values_of(place):
    """The words that a key may have as its value, in whichever of its forms."""
    if isinstance(place, list):
        return [word for entry in place for word in values_of(entry)]
    if not isinstance(place, dict):
        return []
    own = [word for word in [*place.get("enum", []), place.get("const")] if isinstance(word, str)]
    return own + [word for key in ("anyOf", "items", "oneOf") for word in values_of(place.get(key))]


def test_every_key_has_a_description():
    assert [name for name, place in keys_of_the_schema() if len(place.get("description", "")) < 10] == []


def test_every_word_that_a_key_may_have_is_explained_in_its_description():
    for name, place in keys_of_the_schema():
        if name != "units":
            missing = [w for w in values_of(place) if not re.search(rf"(?<!\w){w}(?!\w)", place["description"])]
            assert missing == [], f"{name}: {missing}"


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("Camera.Cx", "px"),
        ("Camera.sensor", "mm"),
        ("Clock.offset_s", "s, "),
        ("Detect.box", "px"),
        ("Run.max_miss", "world"),
    ],
)
def test_a_length_or_a_time_says_its_unit(key, unit):
    assert dict(keys_of_the_schema())[key]["description"].startswith(unit)


def test_the_schema_in_the_workflow_is_the_one_that_the_settings_make():
    stored = Path(__file__).parents[1] / "workflow/schemas/config.schema.json"
    assert json.loads(stored.read_text()) == Settings.model_json_schema(by_alias=True), (
        "make it anew: python -m vidtrack.settings > workflow/schemas/config.schema.json"
    )


def rows_of_the_page():
    """(path, example) of every key on the page."""
    text = (REPO / "docs/configuration.md").read_text()
    rows = re.findall(r"^\| `([^`]+)` \|.*\| (?:`([^`]*)`)? ?\|$", text, re.MULTILINE)
    assert len(rows) > 150
    return [(path.replace("&lt;", "<"), example.replace("\\|", "|")) for path, example in rows]


@pytest.mark.parametrize(("path", "example"), rows_of_the_page(), ids=lambda value: value)
def test_every_key_has_an_example_that_it_may_have(path, example):
    import yaml

    assert example, path
    config = yaml.safe_load(example)
    places = path.replace("<target>", next(iter(config))).split(".")
    assert list(config) == [places[-1]]
    for place in reversed(places[:-1]):
        config = {{"<camera>": "cam1"}.get(place, place.strip("<>")): config}
    window = {"interfaces": {"window": {"point": [0, 0, 0], "normal": [0, 1, 0], "indices": [1, 1.333]}}}
    try:
        settings_from_config({**SMALLEST, **(window if places[-1] == "through" else {}), **config})
        problems = []
    except VidtrackError as error:  # other keys that belong to it may be missing
        problems = error.problems
    here = ".".join({"<camera>": "cam1"}.get(place, place.strip("<>")) for place in places)
    assert [line for line in problems if re.search(rf"{re.escape(here)}[:.]", line)] == []


def test_the_page_of_all_keys_is_that_of_the_settings():
    from vidtrack.settings.key_page import key_page

    shown = (REPO / "docs/configuration.md").read_text()
    assert shown == key_page(), "python -m vidtrack.settings page > docs/configuration.md"


def test_a_plain_list_of_channels_names_columns_alike():
    values = {
        "units": "m",
        "cameras": {"a": {}},
        "runs": {"r": {"channels": {"file": "x.csv", "columns": ["eta", "load"]}}},
    }
    assert settings_from_config(values).runs["r"].channels.columns == {"eta": "eta", "load": "load"}


WINDOW = {"point": [0, 0, 0], "normal": [0, 1, 0], "thickness": 0.5, "indices": [1.0, 1.49, 1.333]}


def test_a_camera_looks_through_one_interface_or_several_in_order():
    surface = {"point": [0, 0, 10], "normal": [0, 0, 1], "indices": [1.333, 1.0]}
    settings = settings_from_config(
        {
            **SMALLEST,
            "interfaces": {"window": WINDOW, "surface": surface},
            "cameras": {"cam1": {"through": "window"}, "cam2": {"through": ["window", "surface"]}, "cam3": {}},
        }
    )
    assert [c.through for c in settings.cameras.values()] == [("window",), ("window", "surface"), ()]
    assert settings.interfaces["window"].sigma.position is None


@pytest.mark.parametrize(
    ("interfaces", "through", "says"),
    [
        ({"window": WINDOW}, "windw", "cameras.cam1.through: no interface 'windw'; did you mean 'window'?"),
        ({}, "window", "describe it under interfaces"),
        ({"window": WINDOW}, ["window", "window"], "stands there twice"),
        ({"window": {**WINDOW, "thickness": None}}, "window", "two more indices than layers"),
        ({"window": {**WINDOW, "normal": [0, 0, 0]}}, "window", "the normal has no length"),
        ({"window": {**WINDOW, "indices": [1, 149, 1.3]}}, "window", "between 0.5 and 5"),
        ({"window": {**WINDOW, "index": 1}}, "window", "no such setting"),
    ],
)
def test_interfaces_that_cannot_be_are_refused_in_a_line(interfaces, through, says):
    lines = refusals(interfaces=interfaces, cameras={"cam1": {"through": through}})
    assert any(says in line for line in lines), lines


@pytest.mark.parametrize(
    ("wand", "what"),
    [
        ({"lengths": {"AB": 20}}, "calibration.wand: lengths names 1 balls; a wand has 2 or 3"),
        ({"lengths": {"A-B": 20, "C-D": 5}}, "calibration.wand: lengths names 4 balls"),
        ({"lengths": {"A-B": 20}, "axes": {"origin": "bob"}}, "calibration.wand.axes: name up, level or drop"),
        ({"lengths": {"A-B": 20}, "axes": {"x": ["a", "b"]}}, "calibration.wand.axes: name up, level or drop"),
        ({"lengths": {"A-B": 20}, "axes": "cam1"}, "calibration.wand.axes: takes `key: value` lines, not 'cam1'. Or: "),
        (20, "calibration.wand: takes `key: value` lines, not 20."),
    ],
)
def test_a_wand_that_cannot_be_is_refused_before_any_work_in_one_line(wand, what):
    with pytest.raises(VidtrackError) as refusal:
        settings_from_config({"units": "in", "cameras": {"cam1": {}}, "calibration": {"wand": wand}})
    (line,) = refusal.value.problems
    assert what in line


def test_a_single_length_is_that_of_a_wand_of_two_balls():
    for key in ("length", "lengths"):
        config = {"units": "in", "cameras": {"cam1": {}}, "calibration": {"wand": {key: 20}}}
        assert settings_from_config(config).calibration.wand.lengths == {"A-B": 20}


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("type: charucco\ncolumns: 8\nrows: 6\nsquare: 30", "type: 'charucco' is not"),
        ("columns: 8\nrows: 6\nsquare: 30\nmarkr: 20", "markr: no such setting; did you mean 'marker'?"),
        ("columns: 8\nrows: 6", "square: missing. Give it; it has no default."),
        ("", "empty. Write at least type, columns, rows and square"),
        ("- 8\n- 6", "Write `key: value` lines"),
        ("columns: 8\nrows: 6\nsquare: 30\nmarker: 40", "a marker of 40 does not fit in a square of 30."),
    ],
)
def test_mistakes_in_a_board_s_description_read_as_those_of_the_config(tmp_path, text, what):
    from vidtrack.files.config_file import read_config
    from vidtrack.settings.board import board_from_values

    path = tmp_path / "board.yaml"
    path.write_text(text)
    with pytest.raises(VidtrackError) as refusal:
        board_from_values(read_config(str(path), "type, columns, rows and square"), str(path))
    (line,) = refusal.value.problems
    assert line.startswith(f"{path}: ")
    assert what in line
    assert "{" not in line.replace("`", "")


def test_a_word_that_yaml_takes_for_true_or_false_is_to_be_put_in_quotes():
    with pytest.raises(VidtrackError) as refusal:
        settings_from_config({"units": "in", "cameras": {"cam1": {}}, "runs": {"test": {"targets": False}}})
    assert "targets: neither a number nor names (put a name such as no, on or true in quotes)" in str(refusal.value)

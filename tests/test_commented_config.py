"""The config.yaml that shows every key."""

import re

import pytest
import yaml

from vidtrack.settings.commented import commented_config, flow
from vidtrack.settings.config import Settings, settings_from_config

VALUES = {
    "units": "mm",
    "cameras": {"left": {}, "right": {}},
    "calibration": {"clips": {"dots": {}, "more": {}}},
    "runs": {"pluck": {"videos": {"left": "a b/pluck.mp4"}}, "other": {"mode": "plane"}},
}


def keys_of(model, seen):
    for name, field in model.model_fields.items():
        seen.add(field.alias or name)
        for part in _models(field.annotation):
            keys_of(part, seen)
    return seen


def _models(annotation):
    from typing import get_args

    if isinstance(annotation, type) and hasattr(annotation, "model_fields"):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models(part)]


def test_what_is_given_is_read_back_and_nothing_else_is_set():
    assert settings_from_config(yaml.safe_load(commented_config(VALUES, "head"))) == settings_from_config(VALUES)


def test_every_key_stands_in_it():
    text = commented_config(VALUES)
    lines = [line for line in text.splitlines() if not re.match(r" *# ", line)]
    shown = set(re.findall(r"([A-Za-z]\w*):", "\n".join(lines)))
    other_ways = {"named", "level", "drop", "y"}  # `points` of a body; what may stand for up and x of a wand's axes
    other_ways |= {"corners"}  # of a tag in place of its centre
    assert shown >= keys_of(Settings, set()) - other_ways


def test_with_every_comment_taken_away_it_is_still_a_config():
    text = re.sub(r"^( *)#(?! )", r"\1", commented_config(VALUES), flags=re.MULTILINE)
    settings = settings_from_config(yaml.safe_load(text))
    assert settings.cameras["left"].sensor == (8.8, 6.6)
    assert settings.runs["pluck"].reference.value == "x_in"


@pytest.mark.parametrize(
    "value", ["yes", "10:00:00:00", "a: b", "- x", "", "12", "null", "größe", "x#y", "1e3", "~", "[a]"]
)
def test_any_text_is_read_back_as_it_is(value):
    assert yaml.safe_load(f"k: {flow(value)}") == {"k": value}
    assert yaml.safe_load(f"k: {flow({'a': [value, 1.5, True, None]})}") == {"k": {"a": [value, 1.5, True, None]}}


def test_a_section_without_entries_is_an_example_in_comments():
    """A folder of runs alone has no clip; no camera, clip or run is made up."""
    given = {"units": "m", "cameras": {"a": {}}, "calibration": {"clips": {}}, "runs": {}}
    config = yaml.safe_load(commented_config(given))
    assert not (config["calibration"] or {}).get("clips")
    assert not config.get("runs")
    assert settings_from_config(config).calibration.clips == {}

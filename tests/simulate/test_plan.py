"""Parts of a scenario: rates, lists of tags, and one line for each mistake."""

from fractions import Fraction

import pytest
from pydantic import Field

from vidtrack.errors import VidtrackError
from vidtrack.simulate.plan import Plan, Positive, Rate, Tags, plan_from


class Lamp(Plan):
    level: Positive = 1.0


class Lab(Plan):
    rate: Rate = Fraction(25)
    tags: Tags = None
    lamps: dict[str, Lamp] = Field({})
    size: tuple[int, int]


def lab(**values):
    return plan_from(Lab, {"size": [4, 3], **values}, "lab.yaml")


def refused(**values):
    with pytest.raises(VidtrackError) as caught:
        lab(**values)
    return list(caught.value.problems)


@pytest.mark.parametrize(
    ("written", "meant"), [(30, 30), (29.97, Fraction(30000, 1001)), ("30000/1001", Fraction(30000, 1001)), (25.0, 25)]
)
def test_a_rate_is_exact(written, meant):
    assert lab(rate=written).rate == meant


@pytest.mark.parametrize(
    ("written", "meant"),
    [("1-3", "1 2 3"), ("1-2, 9,a", "1 2 9 a"), (["1-2", 7, "x-y"], "1 2 7 x-y"), (5, "5"), (("a", "b"), "a b")],
)
def test_tags_are_a_range_or_a_list(written, meant):
    assert lab(tags=written).tags == tuple(meant.split())


@pytest.mark.parametrize("written", [[30], {"a": 1}, None, "30/0", float("inf"), "1e400", 0, "-3/1"])
def test_what_is_no_rate_is_a_line(written):
    with pytest.raises(VidtrackError, match=r"rate: .*(number of frames a second|must be positive)") as said:
        lab(rate=written)
    assert len(str(said.value)) < 250
    assert "\n" not in str(said.value)


def test_a_range_that_nobody_means_takes_no_memory():
    with pytest.raises(VidtrackError, match=r"tags: more than 10,000 tags\. Correct the range, not '1-99999999999'"):
        lab(tags="1-99999999999")


def test_every_mistake_is_a_line_with_its_place():
    lines = refused(lamps={"left": {"level": -1}, "right": {"levl": 2}}, size=[1])
    assert any(line.startswith("lab.yaml: lamps.left.level: ") and line.endswith("not '-1'.") for line in lines)
    assert "lab.yaml: lamps.right.levl: no such setting; did you mean 'level'?" in lines
    assert any(line.startswith("lab.yaml: size.1: missing") for line in lines)
    assert len(lines) == 3


def test_a_setting_like_no_other_is_to_be_removed_and_a_missing_one_given():
    assert refused(zzzz=1) == ["lab.yaml: zzzz: no such setting. Remove it."]
    (line,) = refused(lamps={"left": {"size": [1, 2]}})
    assert "no such setting in this section; 'size' belongs in another one" in line
    with pytest.raises(VidtrackError, match=r"size: missing\. Give it; it has no default"):
        plan_from(Lab, {}, "lab.yaml")


@pytest.mark.parametrize("level", [float("nan"), float("inf"), "bright"])
def test_what_is_no_number_is_refused(level):
    assert len(refused(lamps={"left": {"level": level}})) == 1


def test_a_plan_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        lab().tags = ("1",)

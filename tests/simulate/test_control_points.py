import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.simulate.control_points import MOST_BALLS, ControlPoints, Wires, tags_and_places
from vidtrack.simulate.plan import Plan, plan_from

SPACING = [18.0, 4.0, 6.0]


class Holder(Plan):
    points: ControlPoints


def refused(points):
    with pytest.raises(VidtrackError) as said:
        plan_from(Holder, {"points": points}, "rig.yaml")
    return str(said.value)


def test_balls_on_wires_and_balls_by_name():
    tags, places = tags_and_places(
        plan_from(Holder, {"points": {"rows": 1, "wires": 2, "spacing": SPACING}}, "").points
    )
    assert tags == [str(n) for n in range(1, 9)]
    assert places.mean(0) == pytest.approx([0, 0, 0])
    named = plan_from(Holder, {"points": {"a": [0, 0, 0], "rows": [1, 2, 3]}}, "").points
    tags, places = tags_and_places(named)
    assert tags == ["a", "rows"]
    np.testing.assert_array_equal(places, [[0, 0, 0], [1, 2, 3]])
    assert isinstance(plan_from(Holder, {"points": Wires(spacing=SPACING)}, "").points, Wires)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (
            {"rows": 0, "spacing": SPACING},
            "rig.yaml: points.rows: Input should be greater than or equal to 1, not '0'.",
        ),
        ({"rows": 4}, "rig.yaml: points.spacing: missing. Give it; it has no default."),
        ({"bals": 3, "spacing": SPACING}, "rig.yaml: points.bals: no such setting; did you mean 'balls'?"),
        ({"a": [1, 2]}, "rig.yaml: points.a.2: missing. Give it; it has no default."),
    ],
)
def test_a_mistake_is_told_of_the_form_that_was_written_alone(points, says):
    assert refused(points) == says


@pytest.mark.parametrize("many", [{"balls": 2**31}, {"balls": 2**62, "rows": 3}, {"rows": 400, "wires": 400}])
def test_more_balls_than_anyone_hangs_are_refused_before_they_take_memory(many):
    line = refused({**many, "spacing": SPACING})
    assert str(MOST_BALLS) in line.replace(",", "")
    assert "\n" not in line

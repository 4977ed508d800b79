"""What the config says of coded tags, as the jobs get it."""

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow.tag_orders import tagged, tags_of_run, tags_read


def run(**own):
    config = {"units": "mm", "cameras": {"cam1": {}}, "runs": {"swing": own}}
    return settings_from_config(config).runs["swing"]


def test_a_run_without_tags_has_no_order_of_them():
    assert tags_of_run(run()) is None
    assert tagged(run()) == {}


def test_places_of_tags_become_corners():
    """A tag of side 4 on the side of a body, 10 along x: up is z, and it is read from +x."""
    place = {"centre": [10, 0, 0], "normal": [1, 0, 0], "up": [0, 0, 2]}
    order = tagged(run(tags={"size": 4}, bodies={"float": {"tags": {7: place}}}))
    assert order["tags"]["named"] == [7]
    assert order["tag_bodies"]["float"]["7"] == [[10, -2, 2], [10, 2, 2], [10, 2, -2], [10, -2, -2]]


@pytest.mark.parametrize("place", [[0, 0, 2], {"centre": [0, 0, 2]}, [[-2, 2, 2], [2, 2, 2], [2, -2, 2], [-2, -2, 2]]])
def test_a_centre_or_four_corners_alone_say_where_it_is(place):
    order = tagged(run(tags={"size": 4}, bodies={"float": {"tags": {"tag7": place}, "a": [1, 2, 3]}}))
    assert order["tag_bodies"] == {"float": {"7": [[-2, 2, 2], [2, 2, 2], [2, -2, 2], [-2, -2, 2]]}}
    assert order["tag_targets"] == {"float": {"a": (1, 2, 3)}}


@pytest.mark.parametrize(
    "place",
    [
        {"corners": [[0, 0, 0], [2, 0, 0], [2, -1, 0], [0, -1, 0]]},
        {"normal": [0, 0, 1], "up": [0, 0, 3]},
        {"corners": [[-2, 2, 0], [2, 2, 0], [2, -2, 0], [-2, -2, 0]], "size": 3},
    ],
)
def test_what_is_no_place_of_a_square_is_refused(place):
    with pytest.raises(VidtrackError, match=r"bodies\.float\.tags"):
        run(tags={"size": 4}, bodies={"float": {"tags": {7: place}}})


def test_no_recording_is_read_again_because_tags_are_larger_than_was_thought():
    first, second = (tags_read(run(tags={"size": size, "sigma": 0.01 * size, "ids": [7]})) for size in (4, 5))
    assert first == second == {"family": "36h11", "ids": (7,), "named": [7]}
    assert tags_read(run()) is None

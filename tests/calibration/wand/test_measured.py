"""What the config calls a wand, and late sights whose derivatives are those of their clocks."""

import numpy as np
import pytest

from tests.calibration.wand.waved import waved
from vidtrack.calibration.adjustment.measurements import Sights
from vidtrack.calibration.adjustment.unknowns import State, Unknowns
from vidtrack.calibration.camera.refine import free_parameters
from vidtrack.calibration.wand.measured import LateSights, clock_name, wand_of, wand_problem, wand_state
from vidtrack.errors import VidtrackError


def test_a_wand_is_made_of_the_distances_of_its_balls():
    wand = wand_of({"A-B": 20.0}, None)
    assert wand.ends == ("A", "B")
    assert wand.sd == pytest.approx(0.01)
    three = wand_of({"tip-mid": 5.0, "mid-end": 10.0}, 0.1)
    assert three.values == {"tip-mid": 5.0, "mid-end": 10.0, "tip-end": 15.0}


@pytest.mark.parametrize(
    ("lengths", "text"),
    [
        ({"A": 20.0}, "a wand has 2 or 3"),
        ({"A-B": 1.0, "C-D": 1.0}, "names 4 balls"),
        ({"A-B": 1.0, "B-C": 1.0, "A-C": 3.0}, "no triangle"),
    ],
)
def test_lengths_that_are_no_wand_are_refused(lengths, text):
    with pytest.raises(VidtrackError, match=text):
        wand_of(lengths, None)


def test_late_sights_follow_their_clock():
    scene = waved(31, n=20)
    views = scene.views._replace(velocity=np.full(scene.b.shape, -40.0))
    unknowns = Unknowns([free_parameters("tsai")] * 2, np.zeros(3), (clock_name(1),))
    state = State(tuple(scene.cameras), {clock_name(1): 0.0}, (scene.ends.reshape(20, -1),))
    late = LateSights(Sights(1, views.b[1], views.sd[1]), views.velocity[1])
    here = late.equations(state, unknowns)
    there = late.equations(state._replace(shared={clock_name(1): 1e-3}), unknowns)
    good = np.isfinite(here.residual)
    np.testing.assert_allclose((here.residual - there.residual)[good] / 1e-3, here.by_shared[..., -1][good], rtol=1e-6)


def test_a_problem_has_the_lengths_as_shared_parameters_only_where_they_are_uncertain():
    scene = waved(32, n=30)
    free = [free_parameters("tsai")[6:], free_parameters("tsai")]
    one = wand_problem(scene.views, scene.ends, scene.wand, free, [{}, {}])
    exact = wand_problem(scene.views, scene.ends, scene.wand._replace(sd=0.0), free, [{}, {}], late=[1], clock_sd=1.0)
    assert one.unknowns.shared == ("A-B",)
    assert exact.unknowns.shared == (clock_name(1),)
    assert wand_state(scene.cameras, scene.ends, scene.wand).shared == {"A-B": 20.0}

"""Which projection a wand's cameras are given: as the config says, or as moments left out say."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vidtrack.calibration.wand.projections import by_projection
from vidtrack.calibration.wand.refined import LADDER
from vidtrack.geometry.camera import Camera
from vidtrack.geometry.lens_terms import EQUIDISTANT


def solution(model, held_out, degrees=40.0, misfit=1.0) -> Any:
    """What a projection gave, as far as the choice looks at it."""
    f = 320 / np.tan(np.radians(degrees) / 2)
    camera = Camera(319.5, 239.5, 1.0, 1.0, 1.0, f, 0.0, np.eye(3), np.zeros(3), (640, 480))
    found = SimpleNamespace(factors={"px": misfit})
    rungs = [SimpleNamespace(model="another", held_out=0.0), SimpleNamespace(model=model, held_out=held_out)]
    return SimpleNamespace(cameras=(camera,), found=found, rungs=rungs, model=model)


class Solver:
    """Gives one answer a projection, an error as well; keeps what it was asked."""

    def __init__(self, **answers):
        self.answers, self.asked = answers, []

    def __call__(self, projection, models):
        self.asked.append((projection, models))
        answer = self.answers[projection]
        if isinstance(answer, Exception):
            raise answer
        return answer


@pytest.mark.parametrize("model", EQUIDISTANT)
def test_a_model_of_a_wide_lens_is_solved_in_its_own_projection_alone(model):
    solver = Solver(equidistant=solution(model, 1.0))
    assert by_projection(solver, model).model == model
    assert solver.asked == [("equidistant", (model,))]


def test_a_model_of_a_usual_lens_is_solved_alone():
    solver = Solver(perspective=solution("tsai", 1.0, degrees=100))
    by_projection(solver, "tsai")
    assert solver.asked == [("perspective", ("tsai",))]


def test_auto_tries_no_wide_lens_where_a_usual_one_fits():
    solver = Solver(perspective=solution("tsai", 1.0))
    assert by_projection(solver, "auto") is solver.answers["perspective"]
    assert solver.asked == [("perspective", LADDER)]


@pytest.mark.parametrize("doubt", [{"degrees": 80.0}, {"misfit": 2.0}])
@pytest.mark.parametrize(("other", "best"), [(0.5, "equidistant"), (2.0, "perspective")])
def test_a_wide_or_misfitting_picture_is_given_the_projection_that_predicts_moments_left_out_better(doubt, other, best):
    solver = Solver(perspective=solution("tsai", 1.0, **doubt), equidistant=solution(EQUIDISTANT[0], other))
    assert by_projection(solver, "auto") is solver.answers[best]


def test_a_projection_that_gives_no_cameras_leaves_the_other():
    refused = ValueError("no start")
    wide = Solver(perspective=refused, equidistant=solution(EQUIDISTANT[0], 1.0))
    assert by_projection(wide, "auto") is wide.answers["equidistant"]
    usual = Solver(perspective=solution("tsai", 1.0, misfit=9.0), equidistant=ValueError("no"))
    assert by_projection(usual, "auto") is usual.answers["perspective"]


def test_where_none_gives_cameras_the_usual_lens_says_why():
    with pytest.raises(ValueError, match="too few moments"):
        by_projection(Solver(perspective=ValueError("too few moments"), equidistant=ValueError("other")), "auto")

"""What the config says of a calibration becomes its task, or is refused where it contradicts itself."""

import pytest

from vidtrack.calibration.task_settings import task_from_settings
from vidtrack.errors import VidtrackError

SETTINGS = {
    "where": "config.yaml: cam1",
    "image_size": (512, 480),
    "Cx": None,
    "Cy": None,
    "sensor": None,
    "model": "tsai",
    "refine": "full",
    "fix": {},
    "prior": None,
}


def task(**changes):
    return task_from_settings(**(SETTINGS | changes))


def problems(**changes):
    with pytest.raises(VidtrackError) as caught:
        task(**changes)
    return list(caught.value.problems)


def test_without_a_word_the_axis_is_in_the_middle_and_the_pixel_is_the_unit():
    plain = task().nominal
    assert plain.optics == {"Cx": 255.5, "Cy": 239.5, "dx": 1.0, "dy": 1.0}
    assert plain.image_size == (512, 480)


def test_a_sensor_s_size_gives_the_pitch():
    given = task(sensor=(8.8, 6.6), Cx=250.0, Cy=0.0).nominal
    assert given.optics == {"Cx": 250.0, "Cy": 0.0, "dx": 8.8 / 512, "dy": 6.6 / 480}


def test_what_is_fixed_without_a_value_is_held_at_its_natural_one():
    fixed = task(fix=["Sx", "Cx", "Cy", "kappa1", "skew"], Cx=250.0).fixed
    assert fixed == {"Sx": 1.0, "Cx": 250.0, "Cy": 239.5, "kappa1": 0.0, "skew": 0.0}
    assert task(fix={"f": 12.5, "Sx": 1.02, "kappa1": None}).fixed == {"f": 12.5, "Sx": 1.02, "kappa1": 0.0}


def test_priors_and_the_word_on_outliers_are_passed_on():
    given = task(prior={"Cx": [250, 3]}, reject="off")
    assert given.priors == {"Cx": (250.0, 3.0)}
    assert not given.reject
    assert task().reject
    assert task(reject="auto").reject


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"model": "pinhole"}, "calibration.model: 'pinhole' is not tsai, "),
        ({"refine": "best"}, "calibration.refine: 'best' is not linear, centre, full or bundle"),
        ({"refine": "linear", "model": "brown"}, "model brown has no closed form"),
        ({"refine": "centre", "fix": {"f": 12.0, "kappa1": 0.0}}, "the closed form cannot hold f. Set"),
        ({"refine": "linear", "prior": {"Cx": (1, 1)}}, "the closed form takes no prior"),
        ({"prior": {"kappa2": (0, 1)}}, "calibration.prior: kappa2 is no parameter of model tsai"),
        ({"prior": {"Cx": (0, 1)}, "fix": ["Cx"]}, "calibration.prior: Cx is held by calibration.fix"),
        ({"fix": ["f"]}, "calibration.fix: f has no value to be held at. Give it one: fix: {f: 12.5}."),
        ({"fix": ["kapa1"]}, "calibration.fix: kapa1 has no value to be held at. Known are Sx, Cx, Cy, kappa1"),
    ],
)
def test_settings_that_contradict_each_other_are_one_line(changes, says):
    (line,) = problems(**changes)
    assert line.startswith("config.yaml: cam1: ")
    assert says in line


def test_several_contradictions_are_a_line_each():
    assert len(problems(refine="linear", model="brown", fix={"f": 12.0}, prior={"Cx": (1, 1)})) == 3


def test_the_closed_form_may_hold_what_it_can():
    held = task(refine="linear", fix={"Sx": 1.0, "Cx": 250.0, "Cy": 240.0, "kappa1": 0.0}).held
    assert held == {"Sx": 1.0, "kappa1": 0.0}
    assert task(refine="linear", model="auto").closed
    assert not task(refine="bundle").closed


def test_every_parameter_of_some_model_may_have_a_prior_where_the_model_is_chosen_later():
    assert task(model="auto", prior={"s1": (0, 1e-4), "kappa3": (0, 1e-9)}).priors

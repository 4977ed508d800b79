"""What the misplaced points of a survey are put down to."""

import numpy as np
import pytest

from tests.calibration.rigs import wires
from vidtrack.calibration.surveys.survey import Placed
from vidtrack.calibration.surveys.survey_mistakes import Survey, survey_findings, typing_mistake

TAGS, TRUE = wires()


def said(p, *, unclear=()):
    """The findings where points lie at TRUE and the survey has them at p."""
    off = np.linalg.norm(p - TRUE, axis=1) > 5
    lost = np.zeros(len(p), bool)
    lost[list(unclear)] = True
    place = TRUE + np.random.default_rng(0).normal(0, 0.3, p.shape)
    about = Placed(
        off & ~lost, lost, np.zeros((2, len(p)), bool), place, np.full(p.shape, 0.3), 0.5, np.ones(2, bool), ()
    )
    return survey_findings(Survey(TAGS, p, about, "mm"))


def test_a_wire_is_named_as_one_with_the_size_and_direction_of_its_error():
    p = TRUE.copy()
    p[5:10] -= (115, 0, 0)
    (finding,) = said(p)
    assert finding.code == "wire-misplaced"
    assert "B1, B2, B3, B4, B5" in finding.text
    assert "115 mm" in finding.text
    assert "x +115" in finding.text


def test_a_wire_that_slid_along_itself_or_turned_is_described_so():
    p = TRUE.copy()
    p[5:10, 2] += 80
    assert "along itself" in said(p)[0].text
    p = TRUE.copy()
    angle = np.radians(3)
    p[5:10, 0] += np.sin(angle) * (p[5:10, 2] + 300)
    assert "turned by 3 degrees" in said(p)[0].text


def test_tags_of_a_wire_shifted_by_one_or_counted_from_the_other_end_are_out_of_order():
    p = TRUE.copy()
    p[5:9] = TRUE[6:10]
    p[9] = TRUE[9] + (0, 0, 475)
    assert "shifted by one" in said(p)[0].text
    p = TRUE.copy()
    p[5:10] = TRUE[5:10][::-1]
    p[7] += 1e-9
    (finding,) = said(p)
    assert finding.code == "tags-out-of-order"
    assert "opposite order" in finding.text


def test_two_exchanged_names_are_one_mistake():
    p = TRUE.copy()
    p[[3, 17]] = p[[17, 3]]
    (finding,) = said(p)
    assert finding.code == "tags-exchanged"
    assert "A4 and D3" in finding.text


def test_a_single_point_is_named_with_the_size_and_direction_of_its_error():
    p = TRUE.copy()
    p[12] += (0, 30, -40)
    (finding,) = said(p)
    assert finding.code == "point-misplaced"
    assert "tag C3" in finding.text
    assert "50" in finding.text
    assert "y -30" in finding.text
    assert "z +40" in finding.text


def test_points_on_which_the_cameras_do_not_agree_are_named():
    p = TRUE.copy()
    (finding,) = said(p, unclear=[2])
    assert finding.code == "point-unclear"
    assert "A3" in finding.text


@pytest.mark.parametrize(
    ("surveyed", "true", "said"),
    [
        ((54.0, 2, 3), (45, 2, 3), "two digits exchanged"),
        ((12.5, -20.0, 3), (12.5, 20, 3), "sign"),
        ((12.5, 20, 4.0), (12.5, 20, 101.6), "inches among millimetres"),
        ((12.5, 20, 4.0), (12.5, 20, 48), "feet among inches"),
        ((12.5, 20, 40.0), (12.5, 20, 4), "decimal point"),
        ((12.5, 20, 40.0), (20, 12.5, 40), "x and y are exchanged"),
        ((12.5, 20, 1740.0), (12.5, 20, 1140), "one digit wrong"),
        ((1.0, 2.0, 3.0), (25.4, 50.8, 76.2), "multiplied by 25.4"),
    ],
)
def test_a_mistake_of_typing_is_recognised(surveyed, true, said):
    assert said in typing_mistake(np.array(surveyed), np.array(true, float), np.full(3, 0.02))


def test_what_no_mistake_of_typing_explains_is_not_put_down_to_one():
    assert typing_mistake(np.array([12.5, 20.3, 3.1]), np.array([13.7, 22.0, 4.4]), np.full(3, 0.02)) == ""

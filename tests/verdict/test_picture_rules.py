"""Assumptions about a run's pictures that their background confirms are notes; what it does not show stays a doubt."""

import pytest

from vidtrack.findings import Finding
from vidtrack.verdict.picture_rules import ASSUMED, with_background


def steadiness(**px_and_sd):
    own = {name: {"since_calibration": {"px": at[0], "sd": at[1]} if at else None} for name, at in px_and_sd.items()}
    return {"cameras": own}


FRAMED = Finding("doubtful", "picture-framed", "runs.a: cam1 shows bars about its picture. So.", "Use files.")
SCALED = Finding("doubtful", "picture-scaled", "runs.a: cam1 shows 8 x 6 px. It is taken for the same.", "Confirm it.")
TURNED = Finding("bad", "rotation-differs", "runs.a: cam1's file says 90 degrees. Either way.", "Look at both.")


@pytest.mark.parametrize("finding", [SCALED, FRAMED, TURNED])
def test_a_background_in_its_place_confirms_what_was_assumed(finding):
    (found,) = with_background([finding], steadiness(cam1=(0.05, 0.02)), "runs.a")
    assert found.level == "note"
    assert found.text.startswith(finding.text.split(". ")[0])
    assert found.text.endswith(
        "Its background lies where the calibration clips have it: both show the same part of the scene"
    )
    assert found.cure == ""


@pytest.mark.parametrize(
    "known",
    [
        steadiness(cam1=(5.0, 0.02)),
        steadiness(cam1=(0.2, 0.3)),
        steadiness(cam1=None),
        steadiness(cam10=(0.05, 0.02)),
        {},
    ],
)
def test_a_background_elsewhere_unknown_or_of_another_camera_confirms_nothing(known):
    assert with_background([SCALED, TURNED], known, "runs.a") == [SCALED, TURNED]


def test_other_findings_stay_as_they_are():
    other = Finding("bad", "camera-moved-between", "runs.a: cam1 moved", "Calibrate.")
    assert other.code not in ASSUMED
    assert with_background([other], steadiness(cam1=(0.05, 0.02)), "runs.a") == [other]


@pytest.mark.parametrize("known", [steadiness(cam1=None, cam2=None), steadiness(cam1=(5.0, 9.0), cam2=None, cam3=None)])
def test_a_flag_of_rotation_is_right_where_cameras_that_are_not_turned_see_the_same(known):
    (found,) = with_background([TURNED], known, "runs.a")
    assert found.level == "note"
    assert found.text.endswith("its lines of sight meet those of the other cameras")
    apart = Finding("bad", "sight-lines-miss", "cam1: lines of sight miss.", "")
    assert with_background([TURNED, apart], known, "runs.a") == [TURNED, apart]


def test_where_all_cameras_are_turned_none_of_them_says_that_it_is_right():
    """Turned all alike they may see one scene, upside down."""
    both = [TURNED, TURNED._replace(text=TURNED.text.replace("cam1", "cam2"))]
    assert with_background(both, steadiness(cam1=None, cam2=None), "runs.a") == both

"""Findings of a camera in a run: which camera, when, how much; doubts where the user relies on what is not known."""

import numpy as np

from vidtrack.steadiness.findings import CameraCase, findings_of
from vidtrack.steadiness.history import Episode, History, Moved
from vidtrack.steadiness.turn import Turn

KNOWN = Turn(np.zeros(4), np.eye(4) * 1e-10, np.ones(20, bool))


def case(*, of=20, theta=0.0, since=KNOWN, alike=1.0, start=None, along=None, follow=False, per_px=0.2, flipped=None):
    why = ["" if np.isfinite(theta) else "3 of 20 patches were found again"] * 2
    own = History(np.array([5.0, 9.0]), np.full((2, 4), theta), np.zeros((2, 4, 4)), np.array([of] * 2), why, since,
                  alike, of)  # fmt: skip
    return CameraCase("cam2", "runs.pluck", own, start, along, per_px, "in", follow, flipped)


def only(**more):
    (found,) = findings_of(case(**more))
    return found


def test_a_camera_at_rest_gives_no_finding():
    assert findings_of(case(start=Moved(0.02, 0.02, 3.0))) == []


def test_no_texture_is_a_note_and_a_doubt_where_positions_shall_follow_it():
    assert only(of=0).level == "note"
    assert only(of=0).code == "no-background-texture"
    assert only(of=0, follow=True).level == "doubtful"


def test_what_is_seen_and_never_found_again_is_said():
    assert only(theta=np.nan).code == "steadiness-unknown"
    assert only(theta=np.nan, follow=True).level == "doubtful"


def test_a_movement_since_the_calibration_says_px_and_units():
    small, large = Moved(0.3, 0.02, 500.0), Moved(3.0, 0.02, 9000.0)
    assert only(start=small).level == "doubtful"
    found = only(start=large)
    assert found.level == "bad"
    assert found.code == "camera-moved-between"
    assert "runs.pluck: cam2" in found.text
    assert "3 ± 0.02 px (0.6 in" in found.text
    assert "follow" in found.cure


def test_a_picture_that_grew_is_another_zoom_not_a_camera_that_stood_elsewhere():
    grown = Turn(np.array([0.0, 0.001, 0.0, -0.1]), np.eye(4) * 1e-6, np.ones(20, bool))
    found = only(since=grown, start=Moved(13.0, 0.06, 9000.0))
    assert "its picture is 10 ± 0.1 % smaller: another zoom or focus" in found.text
    assert "autofocus" in found.cure
    kept = Turn(np.array([0.0, 0.001, 0.0, 0.003]), np.eye(4) * 1e-6, np.ones(20, bool))
    assert "zoom" not in only(since=kept, start=Moved(13.0, 0.06, 9000.0)).text


def test_a_picture_of_another_size_that_grew_is_another_part_and_no_zoom():
    grown = Turn(np.array([0.0, 0.001, 0.0, 0.1]), np.eye(4) * 1e-6, np.ones(20, bool))
    own = case(since=grown, start=Moved(13.0, 0.06, 9000.0))
    (found,) = findings_of(own._replace(part=True))
    assert "10 ± 0.1 % larger than the part of the calibration's that it is taken for" in found.text
    assert "crop" in found.cure
    assert "zoom" not in found.text + found.cure


def test_a_movement_along_the_run_says_when():
    along = Episode(6.0, 6.5, Moved(37.0, 0.1, 9e6), Moved(0.1, 0.1, 1.0), sudden=True)
    found = only(along=along)
    assert found.level == "bad"
    assert "6.00 to 6.50 s (1.00 to 1.50 s after its first picture)" in found.text
    assert "suddenly" in found.text
    assert "at its end by 0.1 px" in found.text
    assert "stabiliser" not in found.cure
    assert "If it was the camera's stabiliser, switch that off." in only(along=along._replace(sudden=False)).cure


def test_what_is_corrected_is_a_note():
    assert only(start=Moved(3.0, 0.02, 9000.0), follow=True).level == "note"


def test_a_view_that_resembles_nothing_is_doubtful_and_one_in_part_a_note():
    lost = Turn(np.full(4, np.nan), np.full((4, 4), np.nan), np.zeros(20, bool), "2 of 20 patches were found again")
    assert only(since=lost, alike=0.1).level == "doubtful"
    assert only(since=lost, alike=0.3).level == "note"
    assert only(since=lost, alike=0.3, follow=True).level == "doubtful"


def test_pictures_that_are_turned_are_named_before_a_view_that_resembles_nothing():
    lost = Turn(np.full(4, np.nan), np.full((4, 4), np.nan), np.zeros(20, bool), "2 of 20 patches were found again")
    found = only(since=lost, alike=0.1, flipped="turned by 180 degrees")
    assert (found.level, found.code) == ("bad", "pictures-wrong")
    assert "runs.pluck: cam2: its pictures are turned by 180 degrees, compared with its calibration" in found.text


def test_the_record_holds_what_the_words_say():
    record = case(start=Moved(3.0, 0.02, 9000.0)).record()
    assert record["since_calibration"] == {"px": 3.0, "sd": 0.02, "units": 3.0 * 0.2}
    assert record["along_run"] is None

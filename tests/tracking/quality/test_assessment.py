import numpy as np
import pytest

from tests.discs import picture
from vidtrack.timing.frame import ReadAccount
from vidtrack.tracking.detect_settings import Detection
from vidtrack.tracking.quality.assessment import in_boxes, missing_targets, reading_findings, repeated_pictures
from vidtrack.tracking.sample import Sample
from vidtrack.tracking.state import EDGE, LOST, MEASURED, MERGED, REPEATED, Rows

DETECTION = Detection(noise=2.0)


def shown(radius=5.0, box=(60.0, 40.0, 50.0, 50.0), **settings):
    rng = np.random.default_rng(0)
    luma = picture((120, 160), [(60.0, 40.0, radius)], level=30, contrast=150, noise=2, rng=rng)
    return in_boxes(Sample(luma, 0.0), np.array([box]), Detection(noise=2.0, **settings))[0]


def test_a_box_tells_the_contrast_of_what_is_in_it():
    assert shown().contrast == pytest.approx(150, abs=8)
    assert shown(box=(130.0, 90.0, 40.0, 40.0)).contrast < 9
    assert shown(box=(130.0, 90.0, 40.0, 40.0)).outside == pytest.approx(np.hypot(70, 50), abs=1)


def test_what_goes_on_beyond_its_box_is_told_with_its_whole_size():
    assert not shown().cut
    large = shown(radius=30.0, box=(60.0, 40.0, 30.0, 30.0))
    assert large.cut
    assert large.size == pytest.approx((60, 60), abs=12)
    assert large.contrast == pytest.approx(150, abs=8), "although the box shows nothing else"


def rows(*missing, k=40, n=1):
    values, flag = np.ones((MEASURED, k, n)), np.zeros((k, n), np.int64)
    for first, last, why in missing:
        values[:, first:last], flag[first:last] = np.nan, why
    return Rows(values, np.zeros((k, n, 2)), flag, np.zeros(k))


def codes(rows):
    return [(f.code, f.level) for f in missing_targets(rows, ["a"], None, DETECTION)]


def test_a_target_that_is_always_measured_is_nothing_to_tell():
    assert codes(rows()) == []
    assert codes(rows((10, 12, LOST))) == []


def test_gaps_are_told_with_their_usual_reason():
    (finding,) = missing_targets(rows((10, 12, LOST), (15, 30, MERGED)), ["a"], None, DETECTION)
    assert "57%" in finding.text
    assert "touches something else" in finding.text
    (repeated,) = missing_targets(rows((10, 30, REPEATED)), ["a"], None, DETECTION)
    assert "in most of the others the picture repeats the one before" in repeated.text
    (finding,) = missing_targets(rows((10, 30, EDGE)), ["a"], None, DETECTION)
    assert "edge of the picture" in finding.text


def test_what_one_camera_missed_is_a_doubt_only_where_it_missed_more_than_it_saw():
    assert codes(rows((10, 20, MERGED))) == [("target-rarely-measured", "note")]
    assert codes(rows((5, 33, MERGED))) == [("target-rarely-measured", "doubtful")]
    assert codes(rows((1, 39, MERGED))) == [("target-rarely-measured", "bad")]


def test_a_target_that_comes_late_or_leaves_early_is_noted_and_not_called_lost():
    assert codes(rows((0, 20, LOST))) == [("target-part-of-run", "note")]
    assert codes(rows((5, 40, LOST))) == [("target-part-of-run", "note")]
    assert codes(rows((2, 40, LOST))) == [("target-part-of-run", "doubtful")]


def test_a_target_never_measured_is_bad():
    assert codes(rows((0, 40, LOST))) == [("target-never-measured", "bad")]
    (finding,) = missing_targets(rows((0, 40, LOST)), ["a"], None, DETECTION)
    assert "darker than what is about them: detect.polarity: dark" in finding.cure


def test_repeated_pictures_are_told_where_they_cost_something():
    flags = [False] * 39 + [True]
    assert repeated_pictures(flags, rows()) == []
    (finding,) = repeated_pictures(flags, rows((39, 40, REPEATED)))
    assert finding.level == "doubtful"
    assert "1 of 40 pictures" in finding.text


def test_what_was_seen_while_reading_becomes_findings_and_an_assumed_rate_has_a_cure():
    lines = ("3 pictures are damaged", "pictures that carry no times: 25 a second assumed; give rate")
    found = reading_findings(ReadAccount(10, 0, 3, lines), ["time code: gop says ..."])
    assert [(one.level, one.code) for one in found] == [
        ("doubtful", "reading"),
        ("doubtful", "rate-assumed"),
        ("doubtful", "time-source"),
    ]
    assert "copy it again" in found[0].cure
    assert found[1].cure.startswith("Set rate")

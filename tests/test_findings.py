"""What stages tell the user."""

from vidtrack.findings import Finding, as_records, from_records, worst_first

NOTE = Finding("note", "codec-lossy", "cam1 was recorded with loss.")
BAD = Finding("bad", "picture-size", "cam1 is 640 x 480 in the run, 1280 x 960 in the calibration.", "Give the crop.")
DOUBTFUL = Finding("doubtful", "clock-unknown", "No camera has time code.", "Record a clap.")


def test_findings_survive_json():
    assert from_records(as_records([NOTE, BAD])) == [NOTE, BAD]


def test_the_worst_comes_first_and_ties_keep_their_order():
    other = BAD._replace(code="other")
    assert worst_first([NOTE, BAD, DOUBTFUL, other]) == [BAD, other, DOUBTFUL, NOTE]

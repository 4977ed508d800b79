"""No finding, warning or problem of a record is lost, however deep it stands, and none is counted twice."""

from hypothesis import given
from hypothesis import strategies as st

from vidtrack.findings import Finding, as_records
from vidtrack.verdict.collected import collected, placed

keys = st.sampled_from(["a", "b", "truth", "reading"])
lines = st.text("abcdefgh", min_size=3, max_size=6)
records = st.recursive(
    st.dictionaries(st.sampled_from(["warnings", "problems"]), st.lists(lines, max_size=3), max_size=2),
    lambda inner: st.dictionaries(keys, inner | st.lists(inner, max_size=2), max_size=3),
    max_leaves=8,
)


def said(record):
    """All lines under warnings and problems, by another way: text search of the nested lists."""
    if isinstance(record, list):
        return [line for entry in record for line in said(entry)]
    if not isinstance(record, dict):
        return []
    own = [line for key in ("warnings", "problems") for line in record.get(key, [])]
    return own + [line for key, value in record.items() if key not in ("warnings", "problems") for line in said(value)]


@given(records)
def test_every_line_of_a_record_is_collected_once(record):
    assert sorted(finding.text for finding in collected(record)) == sorted(set(said(record)))


def test_a_line_is_a_doubt_whose_first_sentence_is_the_text_and_the_rest_the_cure():
    (finding,) = collected({"warnings": ["cam1: 0.123 in off. Set its clock: auto. Or look."]})
    assert finding == Finding("doubtful", "warning", "cam1: 0.123 in off", "Set its clock: auto. Or look.")


def test_a_warning_that_a_finding_says_already_is_not_repeated():
    finding = Finding("bad", "camera-moved", "cam1: moved by 3 px", "Lock the mount.")
    record = {"findings": as_records([finding]), "warnings": ["cam1: moved by 3 px. Lock the mount.", "else"]}
    assert collected(record) == [finding, Finding("doubtful", "warning", "else", "")]


def test_what_is_in_the_provenance_is_not_the_records_own():
    assert collected({"provenance": {"warnings": ["old"]}}) == []
    assert collected(None) == []


def test_the_place_is_put_in_front_only_where_the_text_lacks_it():
    assert placed(Finding("note", "a", "tag 3 was lost"), "cam1").text == "cam1: tag 3 was lost"
    assert placed(Finding("note", "a", "cameras.cam1: tag 3"), "cam1").text == "cameras.cam1: tag 3"
    assert placed(Finding("note", "a", "cam11: tag 3"), "cam1").text == "cam1: cam11: tag 3"

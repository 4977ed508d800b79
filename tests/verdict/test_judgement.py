"""One word, its reasons worst first, and what a run inherits from its calibration."""

from hypothesis import given
from hypothesis import strategies as st

from vidtrack.findings import LEVELS, Finding
from vidtrack.verdict.judgement import (
    WORDS,
    added,
    inherited,
    judged,
    not_recorded,
    of_earlier_call,
    terminal_lines,
    worst_word,
)

findings = st.lists(st.builds(Finding, st.sampled_from(LEVELS), st.sampled_from("ab"), st.sampled_from("xyz")))


def test_nothing_found_is_good_and_a_note_changes_nothing():
    note = Finding("note", "read", "field order was guessed")
    assert judged([]).verdict == judged([note]).verdict == "good"
    assert judged([note]).notes == (note,)


@given(findings)
def test_the_word_is_that_of_the_worst_reason_and_reasons_come_worst_first(found):
    judgement = judged(found)
    levels = [LEVELS.index(reason.level) for reason in judgement.reasons]
    assert levels == sorted(levels, reverse=True)
    assert judgement.verdict == (judgement.reasons[0].level if judgement.reasons else "good")
    said = {(finding.level, finding.text) for finding in (*judgement.reasons, *judgement.notes)}
    assert said == {(finding.level, finding.text) for finding in found}
    assert "note" not in {reason.level for reason in judgement.reasons}


def test_causes_come_before_what_follows_from_them_within_a_level():
    codes = ["samples-missing", "nothing-matched", "misfit-large", "warning", "pictures-wrong", "clip-flipped"]
    found = [Finding("doubtful", code, code) for code in codes] + [Finding("bad", "targets-missing", "none")]
    assert [reason.code for reason in judged(found).reasons] == [
        "targets-missing", "pictures-wrong", "clip-flipped", "misfit-large", "samples-missing",
        "nothing-matched", "warning",
    ]  # fmt: skip


def test_a_rule_is_dropped_where_a_stage_said_as_much_and_kept_where_it_is_worse():
    stage = [Finding("doubtful", "points-left-out", "cam1: 2 points, at the rim")]
    ruled = [Finding("doubtful", "points-left-out", "cam1: 2 points"), Finding("bad", "points-left-out", "cam1: 40")]
    ruled.append(Finding("doubtful", "other", "something else"))
    assert added(stage, ruled) == [*stage, *ruled[1:]]
    assert added([], ruled) == ruled


def test_the_worst_of_several_words_counts():
    assert worst_word(["good", "failed", "doubtful"]) == "failed"
    assert worst_word([]) == "good"
    assert list(WORDS) == ["good", "doubtful", "bad", "failed"]


def test_a_run_inherits_the_doubt_about_its_calibration_with_its_reason_and_cure():
    doubt = judged([Finding("doubtful", "few-points", "cam1: 8 points", "Add points.")])
    (finding,) = inherited("the calibration", doubt)
    assert finding == Finding(
        "doubtful", "calibration-doubtful", "the calibration is doubtful: cam1: 8 points", "Add points."
    )
    assert inherited("the calibration", judged([])) == []
    failed = judged([Finding("failed", "x", "no camera")])
    assert inherited("the calibration", failed)[0].level == "bad"


def test_the_terminal_shows_a_line_for_the_calibration_and_each_run_worst_first():
    doubt = judged([Finding("doubtful", "a", "one thing", "Do this."), Finding("doubtful", "b", "another")]).as_record()
    bad = judged([Finding("bad", "c", "the clock is not known")]).as_record()
    good = judged([]).as_record()
    lines = terminal_lines({"calibration": good, "runs": {"a": good, "b": doubt, "c": bad}})
    assert lines == [
        "vidtrack: run c: bad: the clock is not known.",
        "vidtrack: run b: doubtful: one thing. Do this. (1 more reason in the report)",
        "vidtrack: calibration: good",
        "vidtrack: run a: good",
    ]
    assert terminal_lines({"calibration": None, "runs": {}}) == []


def test_runs_that_are_not_recorded_yet_have_a_line_of_their_own():
    record = {"calibration": None, "runs": {}, "awaited": ["a", "b"]}
    assert terminal_lines(record) == ["vidtrack: runs a, b: not recorded yet: there are no such folders in runs/."]
    assert not_recorded(["a"]) == "run a: not recorded yet: there is no such folder in runs/."


def test_results_of_an_earlier_call_have_a_line_of_their_own():
    record = {"calibration": None, "runs": {}, "outdated": ["runs/a/locate.json", "runs/a/trajectories.csv"]}
    (line,) = terminal_lines(record)
    assert line.startswith("vidtrack: results/runs/a/trajectories.csv and 1 more files are of an earlier call")
    assert of_earlier_call(["v.csv"]).startswith("results/v.csv is of an earlier call")

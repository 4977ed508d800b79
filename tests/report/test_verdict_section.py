"""The first screen says what verdict.json says, with the numbers that a reader asks for first."""

from vidtrack.report.verdict_section import verdict_section
from vidtrack.results import CameraResults, Results

GOOD = {"verdict": "good", "reasons": [], "notes": []}


def reason(level, text, cure="Do this."):
    return {"level": level, "code": "x", "text": text, "cure": cure}


def results():
    run = {"samples": 4, "located": 3, "sigma": 0.005, "lag_s": 0.2001, "lag_sd_s": 0.0001}
    record = {"f": 10.95027, "standard_errors": {"f": 0.0718}, "rms_px": 0.2271, "n_points": 60, "model": "tsai"}
    bad = {"verdict": "bad", "reasons": [reason("bad", "the clock is not known")], "notes": [reason("note", "a note")]}
    doubt = {"verdict": "doubtful", "reasons": [reason("doubtful", "cam1: tag 3 was left out")], "notes": []}
    whole = {**doubt, "reasons": [*doubt["reasons"], reason("doubtful", "the lens model is too plain")]}
    return Results(
        cameras={"cam1": CameraResults(record, {"points": 64})},
        summaries={"pluck": run},
        verdict={
            "verdict": "bad",
            "calibration": {**whole, "cameras": {"cam1": doubt}},
            "runs": {"pluck": bad, "gone": GOOD},
        },
    )


def test_each_run_and_each_camera_is_a_line():
    runs, cameras = verdict_section(results(), "in").tables
    assert runs.rows == [
        ["pluck", "bad", "75 %", "0.005", "0.20010", "the clock is not known"],
        ["gone", "good", "–", "–", "–", "–"],
    ]
    assert cameras.rows == [
        ["cam1", "doubtful", "60 of 64", "0.23", "10.950 ± 0.072 mm", "tsai", "cam1: tag 3 was left out"]
    ]


def test_reasons_come_worst_first_with_their_cures_and_notes_apart():
    section = verdict_section(results(), "in")
    assert [(r.key, r.level, r.text, r.cure) for r in section.reasons] == [
        ("run-pluck", "bad", "the clock is not known.", "Do this."),
        ("camera-cam1", "doubtful", "cam1: tag 3 was left out.", "Do this."),
        ("calibration", "doubtful", "the lens model is too plain.", "Do this."),
    ]
    assert [note.text for note in section.notes] == ["a note."]
    assert section.line == "The calibration is doubtful; of 2 runs 1 bad, 1 good."


def test_a_camera_that_failed_has_a_line_without_numbers():
    record = {"verdict": "failed", "calibration": {**GOOD, "cameras": {"cam9": GOOD}}, "runs": {}}
    (cameras,) = verdict_section(Results(verdict=record), "in").tables
    assert cameras.rows[0][:4] == ["cam9", "good", "–", "–"]


def test_what_was_not_judged_is_not_good():
    section = verdict_section(Results(summaries={"pluck": {"samples": 4, "located": 3}}), "in")
    assert (section.word, [why.level for why in section.reasons]) == ("failed", ["failed"])
    assert section.reasons[0].text == "Nothing was judged: there is no verdict.json."


def test_runs_that_are_not_recorded_yet_are_named():
    verdict = {"verdict": "good", "calibration": {**GOOD, "cameras": {}}, "runs": {}, "awaited": ["later"]}
    line = verdict_section(Results(verdict=verdict), "in").line
    assert line == "The calibration is good. Run later: not recorded yet: there is no such folder in runs/."


def test_results_of_an_earlier_call_are_named():
    verdict = {"verdict": "good", "calibration": {**GOOD, "cameras": {}}, "runs": {}, "outdated": ["runs/a/x.csv"]}
    line = verdict_section(Results(verdict=verdict), "in").line
    assert line.startswith("The calibration is good. results/runs/a/x.csv is of an earlier call")

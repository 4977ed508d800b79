"""The verdict of the small laboratory: every record is read, the page shows it first, the terminal shows it last."""

import hashlib
import json

from tests.whole_workflow.conftest import CONFIG, configure, snakemake
from vidtrack.files.records import read_json

KINEMATICS = ".provenance/kinematics/pluck.json"


def test_every_record_that_can_hold_a_finding_is_an_input_of_the_verdict(processed):
    """Whatever rule comes to write findings, warnings or problems: its record must be read."""
    verdict = json.loads((processed / "results/verdict.json").read_text())
    read_by_it = {name.rsplit("results/", 1)[-1] for name in verdict["provenance"]["inputs"]}
    for path in (processed / "results").rglob("*.json"):
        name = str(path.relative_to(processed / "results"))
        if name.startswith(".") or name in ("verdict.json",):
            continue
        text = path.read_text()
        if any(f'"{key}"' in text for key in ("findings", "warnings", "problems", "smoothing")):
            assert name in read_by_it, f"{name} is not an input of the verdict"


def test_only_the_lag_of_a_periodic_motion_is_in_doubt_where_all_else_goes_well(processed):
    verdict = json.loads((processed / "results/verdict.json").read_text())
    assert verdict["calibration"]["verdict"] == verdict["runs"]["still"]["verdict"] == "good"
    assert set(verdict["calibration"]["cameras"]) == {"cam1", "cam2"}
    (reason,) = verdict["runs"]["pluck"]["reasons"]  # two seconds of a sine: half a period fits about as well
    assert "the motion repeats itself" in reason["text"]
    page = (processed / "results/report.html").read_text()
    assert page.index('id="verdict"') < page.index('href="report/run_pluck.html"') < page.index('id="runs"')
    own = (processed / "results/report/run_pluck.html").read_text()
    assert f"<title>Experiment: pluck: {verdict['runs']['pluck']['verdict']}</title>" in own
    assert "the motion repeats itself" in own


def test_a_run_that_locates_one_of_three_targets_is_bad_on_the_page_and_last_on_the_terminal(laboratory):
    config = json.loads(json.dumps(CONFIG))
    config["runs"]["still"] = {"targets": 3}
    configure(laboratory, config)
    answer = snakemake(laboratory)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    own = json.loads((laboratory / "results/verdict.json").read_text())["runs"]["still"]
    assert own["verdict"] == "bad"
    (missing,) = [reason for reason in own["reasons"] if reason["code"] == "targets-missing"]
    assert (missing["level"], missing["text"]) == ("bad", "1 of 3 targets were located")
    assert missing["cure"]
    said = [line for line in answer.stderr.splitlines() if line.startswith("vidtrack: ")]
    assert said[0].startswith("vidtrack: run still: bad: ")
    assert said[1].startswith("vidtrack: run pluck: doubtful: the motion repeats itself")
    assert said[2:] == ["vidtrack: calibration: good", "vidtrack: report: results/report.html"]
    assert "1 of 3 targets were located" in (laboratory / "results/report.html").read_text()


def test_a_warning_of_any_stage_reaches_the_page(laboratory):
    """A record with a warning put into it, as any stage might write one, and the account of its job made to agree."""
    path, account = (laboratory / "results" / name for name in ("runs/pluck/kinematics.json", KINEMATICS))
    record = read_json(path)
    path.write_text(json.dumps({**record, "warnings": ["the wave maker stopped. Film it again."]}))
    made = json.loads(account.read_text())
    made["made"]["results/runs/pluck/kinematics.json"] = hashlib.sha256(path.read_bytes()).hexdigest()
    account.write_text(json.dumps(made))
    answer = snakemake(laboratory, "--forcerun", "verdict")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    page = (laboratory / "results/report.html").read_text()
    assert "the wave maker stopped." in page
    assert "What to do: Film it again." in page

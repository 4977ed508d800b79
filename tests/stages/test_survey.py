"""Stage survey: what all cameras say of the points, and what each camera's calibration then leaves out."""

import numpy as np
import pandas as pd
import pytest

from tests.calibration.rigs import ring, seen, wires
from vidtrack.files.records import read_json, write_png
from vidtrack.files.tables import write_parquet
from vidtrack.jobs import survey as job
from vidtrack.stages.back_project import back_project
from vidtrack.stages.calibrate import calibrate
from vidtrack.stages.survey import judge_survey
from vidtrack.workflow.job import Job

TAGS, P = wires()
SIZE = (1920, 1080)


def tables(survey, b):
    return {
        f"cam{i + 1}": pd.DataFrame(
            {"tag": TAGS, **dict(zip("xyz", survey.T, strict=True)), "Xf": s[:, 0], "Yf": s[:, 1]}
        ).assign(clip="all", found=True, reason="", sd_x=0.1, sd_y=0.1, frames=30)
        for i, s in enumerate(b)
    }


def judged(survey, b, **settings):
    own = tables(survey, b)
    return own, judge_survey(own, dict.fromkeys(own, SIZE), units="mm", **settings)


@pytest.fixture(scope="module")
def eight():
    """Eight cameras, one wire of five surveyed 115 mm off."""
    rng = np.random.default_rng(4)
    cameras = ring(8, rng)
    survey = P + rng.normal(0, 2, P.shape)
    survey[10:15] -= (90, 50, 50)
    return cameras, *judged(survey, seen(cameras, P, rng, 0.3))


def test_a_wire_surveyed_wrongly_is_named_as_a_wire_once(eight):
    _, _, found = eight
    (finding,) = found.findings
    assert finding.code == "wire-misplaced"
    assert "tags C1, C2, C3, C4, C5" in finding.text
    assert "mm from its surveyed place" in finding.text
    assert {len(own) for own in found.left_out.values()} == {5}


def test_no_camera_leaves_out_good_points_for_it_and_the_held_out_error_is_honest(eight):
    _cameras, own, found = eight
    done = [
        calibrate(table, image_size=SIZE, camera=name, left_out=found.left_out[name], units="mm", search=False)
        for name, table in own.items()
    ]
    for each in done:
        assert each.points.loc[~each.points["used"], "tag"].tolist() == ["C1", "C2", "C3", "C4", "C5"]
        assert each.points.loc[10, "reason"].startswith("misplaced in the survey by 11")
    back = back_project([each.camera for each in done], [each.points for each in done], units="mm").record
    assert 2 < back["held_out"]["mean_3d"] < 6  # the survey errs by 2 mm in each coordinate: 3.2 in space


def test_names_exchanged_in_one_camera_are_that_camera_s_and_named(eight):
    cameras, _, _ = eight
    b = seen(cameras[:3], P, np.random.default_rng(1), 0.1)
    b[1, [3, 17]] = b[1, [17, 3]]
    _, found = judged(P, b)
    (finding,) = found.findings
    assert finding.code == "tags-swapped"
    assert "cam2: tags A4 and D3" in finding.text
    assert set(found.left_out["cam2"]) == {("all", "A4"), ("all", "D3")}
    assert not found.left_out["cam1"]


def test_a_wrong_pick_in_one_camera_is_named_with_its_size(eight):
    cameras, _, _ = eight
    b = seen(cameras[:3], P, np.random.default_rng(1), 0.1)
    b[0, 8] += (20, 0)
    _, found = judged(P, b)
    (finding,) = found.findings
    assert finding.code == "sight-mistaken"
    assert "cam1: tag B4 lies 2" in finding.text
    assert "mm at its distance" in finding.text


@pytest.mark.parametrize(("px", "sights", "level"), [(1.2, 1, "note"), (1.2, 3, "doubtful"), (2.5, 1, "doubtful")])
def test_one_ball_that_something_touches_is_left_out_and_no_doubt(eight, px, sights, level):
    cameras, _, _ = eight
    b = seen(cameras[:3], P, np.random.default_rng(1), 0.02)
    b[0, [8, 14, 20][:sights]] += (px, 0)
    _, found = judged(P, b)
    assert len(found.left_out["cam1"]) == sights
    assert [finding.level for finding in found.findings] == [level] * sights


GRID = P.mean(0) + np.stack(np.meshgrid([-1, 0, 1], [-1.5, -0.5, 0.5, 1.5], [-1, 0, 1], indexing="ij"), -1).reshape(
    -1, 3
) * np.ptp(P, axis=0) / [2, 3, 2]
"""Points of three clips, one behind another."""


def of_three_clips(survey, b):
    own = {
        f"cam{i + 1}": pd.DataFrame(
            {"tag": np.arange(36).astype(str), **dict(zip("xyz", survey.T, strict=True)), "Xf": s[:, 0], "Yf": s[:, 1]}
        ).assign(clip=np.repeat(["a", "b", "c"], 12), found=True, reason="", sd_x=0.1, sd_y=0.1, frames=30)
        for i, s in enumerate(b)
    }
    return judge_survey(own, dict.fromkeys(own, SIZE), units="mm")


@pytest.mark.parametrize("px", [(12, -7), (6, -4), (20, 10), (30, 0)])
def test_a_camera_that_was_moved_for_one_clip_is_named_and_not_the_survey(eight, px):
    """Of two cameras: both agree on another place for each point whichever of them was moved."""
    b = seen(eight[0][:2], GRID, np.random.default_rng(1), 0.1)
    b[0, 12:24] += px
    (finding,) = of_three_clips(GRID, b).findings
    assert finding.code == "clip-of-another-view"
    assert "cam1 alone sees the points of clip" in finding.text


@pytest.mark.parametrize("shift", [(60, 0, 30), (0, 60, 0), (-40, 40, 20)])
def test_a_clip_that_was_surveyed_wrongly_is_the_survey_s(eight, shift):
    survey = GRID.copy()
    survey[12:24] += shift
    found = of_three_clips(survey, seen(eight[0][:2], GRID, np.random.default_rng(1), 0.1))
    assert [f.code for f in found.findings] == ["wire-misplaced"]


def test_a_tag_in_several_clips_is_named_once(eight):
    cameras, _, _ = eight
    survey = P.copy()
    survey[6] += (0, 60, 0)
    own = tables(survey, seen(cameras[:3], P, np.random.default_rng(1), 0.1))
    twice = {
        name: pd.concat([table, table.iloc[5:8].assign(clip="again")], ignore_index=True) for name, table in own.items()
    }
    found = judge_survey(twice, dict.fromkeys(own, SIZE), units="mm")
    (finding,) = found.findings
    assert "tag B2 is misplaced" in finding.text
    assert set(found.left_out["cam1"]) == {("all", "B2"), ("again", "B2")}


def test_nothing_is_left_out_where_rejection_is_off_or_one_camera_can_judge(eight):
    _cameras, own, _ = eight
    one = {"cam1": own["cam1"]}
    assert judge_survey(one, {"cam1": SIZE}).record["judged"] is False
    off = judge_survey(own, dict.fromkeys(own, SIZE), reject="off")
    assert off.left_out == {}


def test_the_job_writes_what_it_found(tmp_path, eight):
    _, own, _ = eight
    for name, table in own.items():
        write_parquet(tmp_path / f"{name}.parquet", table, units="mm", provenance={})
        write_png(tmp_path / f"{name}.png", np.zeros(SIZE[::-1], np.uint8))
    names = list(own)[:3]
    settings = {"cameras": names, "units": "mm", "sigma": 0.0, "reject": "auto"}
    inputs = {
        "sightings": [str(tmp_path / f"{name}.parquet") for name in names],
        "pictures": [str(tmp_path / f"{name}.png") for name in names],
    }
    job.run(Job(settings, inputs, {"record": str(tmp_path / "survey.json")}))
    record = read_json(tmp_path / "survey.json")
    assert record["cameras"] == names
    assert [each["tag"] for each in record["misplaced"]] == ["C1", "C2", "C3", "C4", "C5"]
    assert len(record["left_out"]["cam2"]) == 5


def test_many_wrong_names_in_one_camera_are_few_findings_that_say_so():
    rng = np.random.default_rng(7)
    b = np.stack(seen(ring(8, rng), P, rng, 0.3))
    b[0, :9] = np.roll(b[0, :9], 1, axis=0)
    _, found = judged(P, b)
    own = [f for f in found.findings if f.text.startswith("cam1")]
    assert len(own) == 6
    assert own[-1].code == "sights-mistaken"
    assert "4 more tags lie elsewhere in this camera alone" in own[-1].text

import numpy as np
import pandas as pd
import pytest

from tests.motion.test_rigid import FLOAT, targets, voyage
from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet, read_units, write_parquet
from vidtrack.jobs import bodies as job
from vidtrack.stages.bodies import COLUMNS, account, bodies, with_tagged
from vidtrack.workflow.job import Job

BODIES = {"float": {name: place.tolist() for name, place in zip("abc", FLOAT, strict=True)}}


def trajectories(n=90, noise=0.005, sigma=True):
    angles, origin = voyage(n)
    p = targets(angles, origin) + np.random.default_rng(1).normal(0, noise, (n, 3, 3))
    t = 36000 + np.arange(n) * 1001 / 30000
    tables = [
        pd.DataFrame({"time_s": t, "target": name, "x": q[0], "y": q[1], "z": q[2]})
        for name, q in zip("abc", p.T.swapaxes(0, 1), strict=True)
    ]
    table = pd.concat(tables, ignore_index=True).sample(frac=1, random_state=1)
    return table.assign(sigma_x=noise, sigma_y=noise, sigma_z=noise) if sigma else table


def test_six_degrees_of_freedom_at_every_sample_time():
    angles, origin = voyage(90)
    table = bodies(trajectories(), BODIES)
    assert list(table) == list(COLUMNS)
    assert len(table) == 90
    assert np.abs(table[["roll", "pitch", "yaw"]].to_numpy() - np.degrees(angles)).max() < 0.15
    assert np.abs(table[["x", "y", "z"]].to_numpy() - origin).max() < 0.02
    assert (table["flag"] == "").all()
    assert table["sigma_yaw"].median() == pytest.approx(np.degrees(0.005 / (9 * np.sqrt(3))), rel=0.1)


def test_yaw_goes_on_beyond_a_half_turn():
    assert bodies(trajectories(300), BODIES)["yaw"].iloc[-1] == pytest.approx(40 * 299 / 30, abs=0.2)


def test_a_lost_target_leaves_a_row_that_says_so():
    given = trajectories()
    when = given["time_s"].min()
    given = given[~((given["time_s"] == when) & (given["target"] == "a"))]
    table = bodies(given, BODIES)
    assert table["flag"].iloc[0] == "missing"
    assert table.loc[0, ["x", "roll", "qw", "rms"]].isna().all()
    assert table["n_targets"].tolist()[:2] == [2, 3]


def test_swapped_targets_are_flagged():
    given = trajectories()
    given["target"] = given["target"].map({"a": "b", "b": "a", "c": "c"})
    lopsided = {"float": {"a": [9, 0, 0], "b": [0, 5, 0], "c": [0, -9, 0]}}
    assert (bodies(given, lopsided)["flag"] == "misfit").all()


def test_a_body_that_is_not_rigid_is_a_finding_with_its_share():
    given = trajectories()
    given["target"] = given["target"].map({"a": "b", "b": "a", "c": "c"})
    lopsided = {"float": {"a": [9, 0, 0], "b": [0, 5, 0], "c": [0, -9, 0]}}
    record, findings = account(bodies(given, lopsided))
    assert record["float"]["flags"] == {"misfit": 1.0}
    assert [(f.level, f.code) for f in findings] == [("bad", "body-misfit")]
    assert "body float: in 100 % of the samples" in findings[0].text
    record, findings = account(bodies(trajectories(), BODIES))
    assert findings == []
    assert record["float"] == {"samples": 90, "located": 90, "flags": {}, "mean_rms": record["float"]["mean_rms"]}
    assert 0.003 < record["float"]["mean_rms"] < 0.007  # the noise of each coordinate, 0.005


def test_samples_without_a_target_are_counted_and_a_few_of_them_are_no_finding():
    given = trajectories()
    times = np.sort(given["time_s"].unique())
    few = given[~(given["time_s"].isin(times[:4]) & (given["target"] == "a"))]
    some = given[~(given["time_s"].isin(times[:9]) & (given["target"] == "a"))]
    assert account(bodies(few, BODIES))[1] == []
    record, findings = account(bodies(some, BODIES))
    assert record["float"]["located"] == 81
    assert [(f.level, f.code) for f in findings] == [("doubtful", "body-missing")]


def test_without_sigmas_the_pose_is_the_same_and_its_uncertainty_unknown():
    table = bodies(trajectories(sigma=False), BODIES)
    assert table["x"].notna().all()
    assert np.isfinite(table["sigma_x"]).all()  # three targets leave three distances to judge the noise by


def test_a_body_with_an_unknown_target_is_refused_by_name():
    with pytest.raises(VidtrackError, match=r"bodies.float: the run has no target d; it has a, b, c"):
        bodies(trajectories(), {"float": {"a": [0, 0, 0], "b": [1, 0, 0], "d": [0, 1, 0]}})


def test_a_body_of_two_targets_is_refused():
    with pytest.raises(VidtrackError, match="needs three targets"):
        bodies(trajectories(), {"float": {"a": [0, 0, 0], "b": [1, 0, 0]}})


def test_the_job_writes_degrees(tmp_path):
    source, out = str(tmp_path / "t.parquet"), str(tmp_path / "b.parquet")
    write_parquet(source, trajectories(), units="in", provenance={})
    outputs = {"bodies": out, "record": str(tmp_path / "bodies.json")}
    job.run(Job({"units": "in", "run": "pluck", "bodies": BODIES}, {"trajectories": source}, outputs))
    assert read_json(outputs["record"])["bodies"]["float"]["samples"] == len(read_parquet(out))
    assert read_units(out)["roll"] == "deg"
    assert read_units(out)["sigma_x"] == "in"
    assert len(read_parquet(out)) == 90


def test_bodies_that_tags_located_come_behind_the_others_with_their_own_record():
    table = bodies(trajectories(20), BODIES)
    tagged = table.assign(body="buoy")
    both, records = with_tagged(table, tagged, {"buoy": {"tags": 2}})
    assert both["body"].unique().tolist() == ["float", "buoy"]
    assert list(records) == ["buoy"]
    assert (records["buoy"]["tags"], records["buoy"]["located"]) == (2, 20)
    alone, _ = with_tagged(bodies(trajectories(20), {}), tagged, {"buoy": {}})
    assert alone["body"].unique().tolist() == ["buoy"]

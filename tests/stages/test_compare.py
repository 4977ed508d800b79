import json
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.motion.test_lag import SENSOR, VIDEO, pluck
from vidtrack.errors import VidtrackError
from vidtrack.files.tables import read_parquet, read_units, write_csv, write_parquet
from vidtrack.jobs import compare as job
from vidtrack.stages.compare import COLUMNS, compare
from vidtrack.timing.timecode import label_from_frame
from vidtrack.workflow.job import Job

THESIS = Path(__file__).parents[2] / "data/thesis"
SKEW = np.arctan(1 / 30)
"""The thesis's rod: an inch off over thirty (figure 6.12)."""
FRAME = 1_078_921  # 10:00:00:01 or so, at 29.97


def run(n=450, *, lag=0.2, skew=SKEW, seed=1, target="t1"):
    """Trajectories of a target on a skewed rod, the truth, and its sensor's record; ten o'clock."""
    rng = np.random.default_rng(seed)
    frames = FRAME + np.arange(n)
    t = frames * 1001 / 30000
    start = t[0] + 1
    s = pluck(t - lag - start)
    p = np.stack([s * np.cos(skew), s * np.sin(skew), np.zeros(n)], -1)
    located = p + rng.normal(0, VIDEO, p.shape)
    columns = {"time_s": t, "timecode": label_from_frame(frames, Fraction(30000, 1001)), "target": target}
    video = pd.DataFrame({**columns, **{a: located[:, k] for k, a in enumerate("xyz")}})
    video = video.assign(sigma_x=VIDEO, sigma_y=VIDEO, sigma_z=VIDEO, flag="")
    truth = pd.DataFrame({"time_s": t, "target": target, **{a: p[:, k] for k, a in enumerate("xyz")}})
    tr = np.arange(t[0] - 0.5, t[-1] + 0.5, 1 / 30) + 0.007
    reference = pd.DataFrame({"time_s": tr, "x_in": pluck(tr - start) + rng.normal(0, SENSOR, len(tr))})
    return video, reference, truth


def test_before_and_after_the_lag_is_removed():
    video, reference, _ = run()
    done = compare(video, reference, value="x_in", units="in")
    record = done.record
    assert record["lag_s"] == pytest.approx(0.2, abs=0.005)
    assert record["lag_low_s"] < 0.2 < record["lag_high_s"]
    assert record["before"]["rms"] > 2
    assert SENSOR < record["after"]["rms"] < 1.2 * np.hypot(SENSOR, VIDEO) + 0.02
    assert record["after"]["gain"] == pytest.approx(1 / np.cos(SKEW), abs=0.002)
    assert record["after"]["correlation"] > 0.9999
    assert {k: record[k] for k in record["after"]} == record["after"]
    assert {"lag_s", "gain", "bias", "rms", "max_abs", "correlation", "n"} <= set(record)
    assert record["n"] == 450
    low, high = record["limits"]
    assert 0.9 < done.series["difference_aligned"].between(low, high).mean() < 0.99
    assert list(done.series) == list(COLUMNS)


def test_bias_and_gain_are_the_reference_s_against_the_video_s():
    video, reference, _ = run(skew=0)
    reference["x_in"] = 1.02 * reference["x_in"] - 3
    record = compare(video, reference, value="x_in").record
    assert record["gain"] == pytest.approx(1.02, abs=0.002)
    assert record["bias"] == pytest.approx(-3, abs=0.03)
    assert record["mean_difference"] == pytest.approx(-3 + 0.02 * video["x"].mean(), abs=0.1)


def test_a_skewed_rod_has_an_axis_of_its_own():
    video, reference, _ = run(skew=0.3)
    plain, own = (compare(video, reference, value="x_in", axis=a).record for a in ("x", "auto"))
    for record in (plain, own):
        assert record["axis"]["skew_deg"] == pytest.approx(np.degrees(0.3), abs=0.05)
        assert record["axis"]["nearest"] == "x"
    assert plain["gain"] == pytest.approx(1 / np.cos(0.3), abs=0.003)
    assert own["gain"] == pytest.approx(1, abs=0.002)
    assert own["rms"] < 0.1 < plain["rms"]


def test_motion_that_is_no_line_is_told_with_axis_auto():
    video, reference, _ = run()
    video["y"] = 10 * np.sin(3 * video["time_s"])
    assert any("one line" in w for w in compare(video, reference, value="x_in", axis="auto").record["warnings"])


@pytest.mark.parametrize("write", ["time code", "ISO"])
def test_the_sensor_may_write_its_times_in_its_own_way(write):
    video, reference, _ = run()
    if write == "time code":
        frames = FRAME + np.arange(-10, 460)
        t = frames * 1001 / 30000
        reference = pd.DataFrame({"x_in": pluck(t - video["time_s"][0] - 1)})
        reference["time_s"] = label_from_frame(frames, Fraction(30000, 1001))
    else:
        day = pd.Timestamp("2026-01-31")
        reference["time_s"] = [(day + pd.Timedelta(seconds=s)).isoformat() for s in reference["time_s"]]
    record = compare(video, reference, value="x_in").record
    assert record["lag_s"] == pytest.approx(0.2, abs=0.005)
    assert record["reference"]["time_written_as"] == write


def test_table_5_2_of_the_thesis_reads_as_an_even_record():
    """200 samples a second printed to 0.01 s. Table 5.1 begins four seconds later: they share no time."""
    table = pd.read_csv(THESIS / "table-5.2.csv")
    t = table["time_s"][0] + np.arange(30) / 30
    video = pd.DataFrame({"time_s": t, "target": "t1", "x": np.linspace(-17, -13, 30), "y": 0.0, "z": np.nan})
    record = compare(video, table, value="x_in").record
    assert any("every 0.005" in w for w in record["warnings"])
    assert record["reference"]["rate_hz"] == pytest.approx(200, rel=0.02)
    late = pd.read_csv(THESIS / "table-5.1.csv")
    assert late["timecode"].min() == "10:00:58:09"
    apart = compare(video.assign(time_s=video["time_s"] + 4), table, value="x_in").record
    (finding,) = apart["findings"]
    assert re.search(r"36054\.55\d to 36054\.7.*nothing is compared", finding["text"])
    assert (finding["level"], apart["n"]) == ("bad", 0)


@pytest.mark.parametrize("unit", [12.0, 1 / 25.4])
def test_a_survey_in_another_unit_than_the_sensor_is_told(unit):
    video, reference, _ = run()
    reference["x_in"] *= unit
    told = " ".join(compare(video, reference, value="x_in").record["warnings"])
    assert f"the reference moves {unit:.2g}"[:26] in told
    assert "one unit of length" in told
    assert "unit" not in " ".join(compare(*run()[:2], value="x_in").record["warnings"])


@pytest.mark.parametrize("located", [0, 7])
def test_a_target_that_was_hardly_ever_located_is_told_and_stops_nothing(located):
    video, reference, truth = run()
    video.loc[located:, ["x", "y", "z"]] = np.nan
    done = compare(video, reference, truth, value="x_in")
    assert not np.isfinite(done.record["lag_s"])
    assert f"{located} samples were located: too few to compare with the reference" in done.record["warnings"]
    assert len(done.series) == len(video)


def test_samples_out_of_order_are_sorted_and_told():
    video, reference, _ = run()
    record = compare(video, reference.sample(frac=1, random_state=1), value="x_in").record
    assert record["lag_s"] == pytest.approx(0.2, abs=0.005)
    assert any("do not rise" in w for w in record["warnings"])


def test_the_truth_is_held_against_every_target_by_axis():
    video, _, truth = run()
    second, _, _ = run(seed=2, target="t2")
    both = pd.concat([video, second])
    done = compare(both, truth=pd.concat([truth, truth.assign(target="t2")]), field_diagonal=160)
    told = done.record["truth"]
    assert told["mean"] == pytest.approx(VIDEO * np.sqrt(8 / np.pi), rel=0.05)  # of a Maxwell distribution
    assert told["rms"] == pytest.approx(VIDEO * np.sqrt(3), rel=0.05)
    assert told["one_over"] == pytest.approx(160 / told["mean"])
    assert told["rms_by_axis"]["y"] == pytest.approx(VIDEO, rel=0.1)
    assert told["normalised_variance"]["z"] == pytest.approx(1, abs=0.15)
    assert set(told["by_target"]) == {"t1", "t2"}
    assert done.series["error_x"].notna().sum() == 900


def test_truth_of_other_times_is_read_between_its_samples():
    video, _, truth = run()
    told = compare(video.iloc[::2], truth=truth.iloc[1::2]).record["truth"]
    assert told["mean"] < 0.03


def test_in_a_plane_the_error_is_two_dimensional():
    video, _, truth = run()
    told = compare(video.assign(z=np.nan), truth=truth.assign(z=0.0)).record["truth"]
    assert set(told["mean_abs"]) == {"x", "y"}
    assert told["rms"] == pytest.approx(VIDEO * np.sqrt(2), rel=0.05)


def test_a_missing_column_is_named_with_those_there_are():
    video, reference, _ = run()
    with pytest.raises(VidtrackError, match=r"no column 'x_cm'; it has time_s, x_in"):
        compare(video, reference, value="x_cm")


def test_a_run_of_several_targets_needs_the_one_that_the_sensor_holds():
    video, reference, _ = run()
    with pytest.raises(VidtrackError, match=r"which one\? Set reference.target"):
        compare(pd.concat([video, video.assign(target="t2")]), reference, value="x_in")
    never = compare(video, reference, value="x_in", target="t9").record
    assert never["n"] == 0
    assert "target t9 of the reference was never located; located: t1" in never["findings"][0]["text"]


def test_nothing_to_compare_with_is_refused():
    with pytest.raises(VidtrackError, match="neither a reference nor the truth"):
        compare(run()[0])


def test_the_job_takes_its_field_from_the_calibration(tmp_path):
    video, reference, truth = run()
    paths = {
        n: str(tmp_path / n) for n in ("t.parquet", "reference.csv", "truth.csv", "field.json", "c.json", "c.parquet")
    }
    write_parquet(paths["t.parquet"], video, units="in", provenance={})
    write_csv(paths["reference.csv"], reference.assign(note="a column that nobody asked for"))
    write_csv(paths["truth.csv"], truth)
    Path(paths["field.json"]).write_text('{"diagonal_field": 160.0}')
    settings = {"units": "in", "run": "pluck", "time": "time_s", "value": "x_in", "axis": "x", "target": "t1"}
    inputs = {"trajectories": paths["t.parquet"], "reference": paths["reference.csv"]}
    inputs |= {"truth": paths["truth.csv"], "field": paths["field.json"]}
    job.run(Job(settings, inputs, {"comparison": paths["c.json"], "series": paths["c.parquet"]}))
    record = json.loads(Path(paths["c.json"]).read_text())
    assert record["lag_s"] == pytest.approx(0.2, abs=0.005)
    assert record["truth"]["one_over"] > 5000
    assert read_units(paths["c.parquet"])["reference_aligned"] == "in"
    assert len(read_parquet(paths["c.parquet"])) == 450


def test_truth_of_a_target_that_was_never_located_counts_none_and_stops_nothing():
    video, reference, truth = run()
    more = pd.concat([truth, truth.assign(target="t3")])
    record = compare(video, reference, more, value="x_in").record
    assert record["truth"]["by_target"]["t3"] == {"n": 0}
    assert record["truth"]["n"] > 0
    assert [(f["level"], f["code"]) for f in record["findings"]] == [("doubtful", "truth-target-missing")]
    alone = compare(pd.concat([video, video.assign(target="t2")]), None, truth.assign(target="t3")).record
    assert alone["truth"]["n"] == 0
    assert alone["findings"][0]["level"] == "bad"


def test_a_logger_without_a_clock_is_brought_to_the_video_by_correlation_when_asked():
    video, reference, _ = run()
    start = float(reference["time_s"].iloc[0])
    bare = reference.assign(time_s=reference["time_s"] - start)
    apart = compare(video, bare, value="x_in").record
    assert apart["n"] == 0
    assert "offset_s, or auto" in apart["findings"][0]["cure"]
    found = compare(video, bare, value="x_in", offset_s="auto").record
    assert found["reference"]["offset_s"] == pytest.approx(start + 0.2, abs=0.01)
    assert found["correlation"] > 0.99
    given = compare(video, bare, value="x_in", offset_s=start).record
    assert given["lag_s"] == pytest.approx(0.2, abs=0.005)


def test_a_reference_that_counts_non_drop_frames_from_midnight_is_told_what_brings_it_together():
    video, reference, _ = run()
    counted = reference.assign(time_s=reference["time_s"] * 1.001)
    finding = compare(video, counted, value="x_in").record["findings"][0]
    offset = float(finding["cure"].split(": ")[1].rstrip("."))
    assert offset == pytest.approx(-36.0, abs=0.2)
    assert compare(video, counted, value="x_in", offset_s=offset).record["n"] > 0


def test_a_reference_in_whole_seconds_leaves_the_lag_open_by_half_a_second_either_way():
    video, reference, _ = run()
    cut = reference.assign(time_s=np.floor(reference["time_s"]))
    record = compare(video, cut, value="x_in").record
    assert record["lag_low_s"] < 0.2 < record["lag_high_s"]
    assert record["lag_sd_s"] > 0.28
    assert record["reference"]["resolution_s"] == 1.0

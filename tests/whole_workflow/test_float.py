"""A float on interlaced tape with time code in the sound, filmed by cameras that nobody locked together."""

import json
import re

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.whole_workflow.conftest import REPO, configure, planned, snakemake

OFFSET = 0.012
PAGE = yaml.safe_load(re.search(r"```yaml\n(.*?)```", (REPO / "docs/self-calibration.md").read_text(), re.DOTALL)[1])


def scenario():
    """data/float.yaml, shorter: two of its cameras, two seconds of its float."""
    values = yaml.safe_load((REPO / "data/float.yaml").read_text())
    values["cameras"] = {name: values["cameras"][name] for name in ("north", "south")}
    values["cameras"]["south"]["clock"] = {"offset_s": OFFSET, "rate_ppm": 0}
    values["clutter"] = [own for own in values["clutter"] if own["camera"] == "north"]
    values["calibration"]["frames"] = 3
    heave = values["runs"]["heave"]
    values["runs"] = {"heave": {**heave, "duration_s": 2.5, "hidden": [], "lost_frames": {}, "first_frame": {}}}
    return values


@pytest.fixture(scope="module")
def basin(tmp_path_factory):
    from vidtrack.simulate.laboratory import set_up
    from vidtrack.simulate.scenario import scenario_from

    folder = tmp_path_factory.mktemp("float") / "basin"
    set_up(scenario_from(scenario(), "scenario"), str(folder))
    config = yaml.safe_load((folder / "config.yaml").read_text())
    config["cameras"]["south"]["clock"] = "auto"
    config["runs"]["heave"]["bodies"] = PAGE["runs"]["heave"]["bodies"]
    config["calibration"]["self"] = PAGE["calibration"]["self"]
    configure(folder, config)
    answer = snakemake(folder)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    return folder


def record(folder, name):
    return json.loads((folder / "results/runs/heave" / name).read_text())


def test_time_comes_from_the_sound(basin):
    assert record(basin, "centroids/north.json")["time"]["source"] == "ltc"


def test_each_frame_gives_two_samples_half_a_frame_apart(basin):
    table = pd.read_parquet(basin / "results/runs/heave/centroids/north.parquet")
    one = table[table["target"] == "bow"]
    assert set(one["field"]) == {"top", "bottom"}
    assert np.diff(one["time_s"]).mean() == pytest.approx(1001 / 60000, rel=1e-3)


def test_the_motion_tells_how_far_the_clocks_are_apart(basin):
    """12 ms is 0.72 of a field; it is asked to 0.02 of a frame."""
    own = record(basin, "locate.json")["clocks"]["cameras"]["south"]
    assert own["source"] == "motion"
    assert own["offset_s"] == pytest.approx(OFFSET, abs=0.02 * 1001 / 30000)


def test_three_targets_make_six_degrees_of_freedom(basin):
    """The targets ride on a rigid body, so its fit leaves no more than their own errors; and it heaves and rolls."""
    bodies = pd.read_parquet(basin / "results/runs/heave/bodies.parquet")
    assert bodies["rms"].median() < 0.02
    truth = pd.read_csv(basin / "runs/heave/truth.csv")
    centre = truth.groupby("time_s")[["x", "y", "z"]].mean()  # of the three; the body's origin lies beside it
    moved = np.interp(bodies["time_s"], centre.index, centre["z"])
    good = bodies["z"].notna()
    assert np.corrcoef(moved[good], bodies.loc[good, "z"])[0, 1] > 0.9
    assert bodies["roll"].std() > 0.5


def test_the_float_is_located_to_a_hundredth_of_an_inch(basin):
    """Survey errors of the scenario, 16 px balls, 0.02 px of noise; without the clock the error would be tenfold."""
    truth = record(basin, "comparison.json")["truth"]
    assert 0.0005 < truth["mean"] < 0.015


def test_the_float_refines_the_cameras_and_the_run_is_located_by_them(basin):
    """docs/self-calibration.md: the survey is good to 0.02 in, so residuals fall by a third and distances stay."""
    done = json.loads((basin / "results/calibration/self.json").read_text())
    assert done["used"]
    assert done["held_out"]["residual_px"]["after"] < 0.8 * done["held_out"]["residual_px"]["before"]
    assert done["held_out"]["distance"]["after"] < 1.1 * done["held_out"]["distance"]["before"]
    refined = json.loads((basin / "results/calibration/north/refined.json").read_text())
    first = json.loads((basin / "results/calibration/north/camera.json").read_text())
    assert refined["f"] != first["f"]
    assert refined["joint"]["cameras"] == ["north", "south"]
    assert "results/calibration/north/refined.json" in record(basin, "locate.json")["provenance"]["inputs"]
    notes = json.loads((basin / "results/verdict.json").read_text())["calibration"]["notes"]
    assert "self-calibration-used" in [note["code"] for note in notes]


def test_without_the_body_the_run_is_located_by_the_surveyed_cameras_and_no_film_is_read_again(basin):
    config = yaml.safe_load((basin / "config.yaml").read_text())
    del config["calibration"]["self"]
    text = (basin / "config.yaml").read_text()
    configure(basin, config)
    jobs = planned(basin)
    (basin / "config.yaml").write_text(text)
    assert jobs["locate"] == 1
    assert not {"track", "calibration_points", "calibrate", "body_sights", "self_calibrate"} & set(jobs)

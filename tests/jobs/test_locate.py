"""The job reads tables and cameras, and writes trajectories with units and a record."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.camera_json import write_camera
from vidtrack.files.records import write_json
from vidtrack.files.tables import read_parquet, read_units, write_parquet
from vidtrack.geometry.camera import project
from vidtrack.jobs.locate import run
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.timing.run_scale import code_as_record
from vidtrack.timing.timecode import Timecode
from vidtrack.workflow.job import Job

N = 60


def centroid_table(b):
    t = np.arange(N) / 30
    return pd.DataFrame({"time_s": t, "timecode": "", "target": "t1", "Xf": b[:, 0], "Yf": b[:, 1], "flag": ""})


def outputs(folder):
    return {
        "trajectories": str(folder / "t.parquet"),
        "csv": str(folder / "t.csv"),
        "associations": str(folder / "a.parquet"),
        "record": str(folder / "locate.json"),
    }


@pytest.fixture
def space(tmp_path):
    """An order for two cameras, and where the target is."""
    rng = np.random.default_rng(0)
    p = np.stack([10 * np.cos(np.arange(N) / 8), np.zeros(N), np.zeros(N)], -1)
    tags, places = thesis_points()
    inputs = {"centroids": [], "cameras": [], "points": []}
    for camera in thesis_rig(2):
        paths = {kind: str(tmp_path / f"{camera.name}_{kind}") for kind in inputs}
        table = centroid_table(project(camera, p) + rng.normal(0, 0.1, (N, 2)))
        write_parquet(paths["centroids"], table, units="in", provenance={})
        write_camera(paths["cameras"], camera, None, {})
        points = pd.DataFrame(places, columns=["x", "y", "z"]).assign(tag=tags, used=True)
        write_parquet(paths["points"], points, units="in", provenance={})
        for kind, path in paths.items():
            inputs[kind].append(path)
    settings = {
        "run": "pluck",
        "units": "in",
        "mode": "space",
        "cameras": ["cam1", "cam2"],
        "targets": 1,
        "plane": None,
    }
    settings |= {"clocks": {"cam1": {"offset_s": 0.0, "rate_ppm": 0.0}, "cam2": "auto"}, "tolerance_px": 3.0}
    return Job(settings, inputs, outputs(tmp_path), {"vidtrack": "test"}), p


def test_two_cameras_tables_become_trajectories(space):
    job, p = space
    run(job)
    table = read_parquet(job.outputs["trajectories"])
    assert len(table) >= N - 1  # a clock off by microseconds takes a moment at an end
    frames = (table["time_s"].to_numpy() * 30).round().astype(int)
    assert table["x"].to_numpy() == pytest.approx(p[frames, 0], abs=0.15)
    units = read_units(job.outputs["trajectories"])
    assert units["x"] == units["sigma_z"] == units["miss"] == "in"
    assert units["time_s"] == "s"
    assert len(pd.read_csv(job.outputs["csv"])) == len(table)
    record = json.loads(Path(job.outputs["record"]).read_text())
    assert record["provenance"] == {"vidtrack": "test"}
    assert record["clocks"]["cameras"]["cam2"]["source"] == "motion"
    assert record["volume"]["share_outside"] == 0


def test_cameras_with_non_drop_code_are_put_on_the_scale_of_the_earliest_first_label(space, tmp_path):
    """The second camera began a minute later by its label: 60.06 s in truth, of which its own reading knows 60."""
    job, _ = space
    rate = Fraction(30000, 1001)
    late = 1800
    codes = [Timecode(10 * 3600 * 30, rate), Timecode(10 * 3600 * 30 + late, rate)]
    readings = []
    for k, (path, code, camera) in enumerate(zip(job.inputs["centroids"], codes, thesis_rig(2), strict=True)):
        frames = np.arange(late + N) if k == 0 else np.arange(late, late + N)
        x = np.stack([10 * np.cos(frames / 8), np.zeros(frames.size), np.zeros(frames.size)], -1)
        b = project(camera, x)
        time_s = float(code.clock) + (frames - frames[0]) / float(rate)
        table = pd.DataFrame(
            {"time_s": time_s, "timecode": "", "target": "t1", "Xf": b[:, 0], "Yf": b[:, 1], "flag": ""}
        )
        write_parquet(path, table, units="in", provenance={})
        readings.append(str(tmp_path / f"r{k}"))
        write_json(readings[-1], {"time": {"code": code_as_record(code)}}, {})
    settings = job.settings | {"clocks": {name: {"offset_s": 0.0, "rate_ppm": 0.0} for name in ("cam1", "cam2")}}
    run(Job(settings, {**job.inputs, "readings": readings}, job.outputs, {}))
    table = read_parquet(job.outputs["trajectories"])
    assert len(table) == N
    np.testing.assert_allclose(table["time_s"], 36000 + (late + np.arange(N)) * 1001 / 30000, atol=1e-6)
    np.testing.assert_allclose(table["x"], 10 * np.cos((late + np.arange(N)) / 8), atol=1e-3)
    record = json.loads(Path(job.outputs["record"]).read_text())
    assert record["time"]["shift_s"] == {"cam1": 0, "cam2": pytest.approx(0.06)}


def test_targets_that_are_lit_from_one_side_and_not_as_high_as_balls_are_doubtful(space, tmp_path):
    job, _ = space
    ball = [camera.dx / (camera.Sx * camera.dy) for camera in thesis_rig(2)]
    said = {}
    for share in (1.0, 0.7):
        readings = []
        for k in range(2):
            readings.append(str(tmp_path / f"r{k}"))
            light = {"height": ball[k] * (share if k else 1.0), "height_sd": 0.004}
            write_json(readings[-1], {"lighting": light}, {})
        run(Job(job.settings, {**job.inputs, "readings": readings}, job.outputs, {}))
        findings = json.loads(Path(job.outputs["record"]).read_text())["findings"]
        said[share] = [one["text"] for one in findings if one["code"] == "lit-targets-no-balls"]
    assert said[1.0] == []
    (text,) = said[0.7]
    assert "cam2" in text


def test_a_run_of_one_camera_names_its_place_in_the_config(space):
    job, _ = space
    one = {kind: paths[:1] for kind, paths in job.inputs.items()}
    with pytest.raises(VidtrackError, match=r"^runs\.pluck: mode space needs two cameras"):
        run(Job(job.settings | {"cameras": ["cam1"]}, one, job.outputs, {}))


@pytest.fixture
def plane(tmp_path):
    """An order for one camera and known points in a plane, 0.25 in a px."""
    b = np.stack([100.0 + np.arange(N), np.full(N, 200.0)], -1)
    write_parquet(tmp_path / "c", centroid_table(b), units="in", provenance={})
    known = pd.DataFrame([[50.0, 60], [450, 60], [450, 400], [50, 400], [250, 200]], columns=["Xf", "Yf"])
    known = known.assign(tag=list("abcde"), x=known["Xf"] / 4, y=-known["Yf"] / 4, z=0.0, clip="row1")
    write_parquet(tmp_path / "s", known, units="in", provenance={})
    write_json(tmp_path / "r", {"image_size": [512, 480]}, {})
    inputs = {"centroids": [str(tmp_path / "c")], "readings": [str(tmp_path / "r")], "sightings": str(tmp_path / "s")}
    settings = {
        "run": "toss",
        "units": "in",
        "mode": "plane",
        "cameras": ["cam1"],
        "targets": 1,
        "clocks": {"cam1": "auto"},
    }
    return lambda **how: Job(settings | {"plane": {"aspect": 1.0, **how}}, inputs, outputs(tmp_path), {})


def test_one_camera_and_a_scale_make_a_plane_run(plane):
    job = plane(scale=0.25, points=None, clip=None)
    run(job)
    table = read_parquet(job.outputs["trajectories"])
    assert table["x"].to_numpy() == pytest.approx((100 + np.arange(N)) / 4)
    assert table["z"].isna().all()


def test_known_points_of_the_clip_that_is_named_make_a_plane_run(plane):
    job = plane(scale=None, points="calibration/points.csv", clip="row1")
    run(job)
    assert read_parquet(job.outputs["trajectories"])["x"].to_numpy() == pytest.approx(
        (100 + np.arange(N)) / 4, abs=0.01
    )
    with pytest.raises(VidtrackError, match=r"runs\.toss\.plane\.clip: .*'row2' \(clips: row1\)"):
        run(plane(scale=None, points="calibration/points.csv", clip="row2"))


def test_large_balls_in_a_plane_have_the_sd_of_their_perspective(plane):
    # the plane of small points does not know f: a ball of radius 20 px at 240 px from the middle may be 0.3 px off
    job = plane(scale=None, points="calibration/points.csv", clip="row1")
    table = read_parquet(job.path("centroids")).assign(sd_x=0.01, sd_y=0.01)
    sigma = {}
    for radius in (1.0, 20.0):
        own = table.assign(pixels=np.pi * radius**2)
        write_parquet(job.path("centroids"), own, units="in", provenance={})
        write_json(job.path("readings"), {"image_size": [512, 480], "video": {"width": 512, "height": 480}}, {})
        run(job)
        sigma[radius] = read_parquet(job.outputs["trajectories"])["sigma_x"].to_numpy()
    off = 0.25 * (20.0**2) * np.abs(table["Xf"].to_numpy() - 255.5) / 512**2
    assert np.sqrt(sigma[20.0] ** 2 - sigma[1.0] ** 2) == pytest.approx(off, rel=0.03)


def test_recordings_without_any_time_code_that_were_started_seconds_apart_are_brought_together(space, tmp_path):
    job, _ = space
    t = np.arange(600) / 30

    def path(t):
        return np.stack([15 * np.sin(0.3 * t) + 6 * np.sin(1.7 * t), 3 * np.sin(0.53 * t), 4 * np.cos(0.41 * t)], -1)

    readings = []
    for k, (table, camera) in enumerate(zip(job.inputs["centroids"], thesis_rig(2), strict=True)):
        b = project(camera, path(t + 4.21 * k))
        columns = {"time_s": t, "timecode": "", "target": "t1", "Xf": b[:, 0], "Yf": b[:, 1], "flag": ""}
        write_parquet(table, pd.DataFrame(columns), units="in", provenance={})
        readings.append(str(tmp_path / f"r{k}"))
        write_json(readings[-1], {"time": {"code": None}}, {})
    settings = job.settings | {"clocks": {"cam1": None, "cam2": None}}
    run(Job(settings, {**job.inputs, "readings": readings}, job.outputs, {}))
    record = json.loads(Path(job.outputs["record"]).read_text())
    assert record["clocks"]["cameras"]["cam2"]["offset_s"] == pytest.approx(4.21, abs=0.002)
    assert record["clocks"]["cameras"]["cam2"]["source"] == "motion"
    table = read_parquet(job.outputs["trajectories"])
    np.testing.assert_allclose(table["x"], path(table["time_s"].to_numpy())[:, 0], atol=0.02)


def test_rows_that_are_read_one_after_the_other_are_brought_to_their_frames_in_a_plane_too(plane, tmp_path):
    """150 px/s down the picture: 30 ms of read-out would misplace it by up to 1.1 in."""
    t, v, readout, rows = np.arange(N) / 30, 150.0, 0.030, 480
    seen = t + readout * (50 + v * t + 0.5) / rows / (1 - readout * v / rows)  # when its row is read
    b = np.stack([np.full(N, 100.0), 50 + v * seen], -1)
    write_parquet(tmp_path / "c", centroid_table(b), units="in", provenance={})
    stated = {"ms": 1e3 * readout, "source": "GoPro's SROT", "doubt": "", "steady": True}
    video = {"width": 512, "height": rows, "readout": stated}
    write_json(tmp_path / "r", {"video": video}, {})
    job = plane(scale=0.25, points=None, clip=None)
    run(job)
    table = read_parquet(job.outputs["trajectories"])
    assert table["y"].to_numpy() == pytest.approx((50 + v * t) / 4, abs=1e-3)
    record = json.loads(Path(job.outputs["record"]).read_text())
    assert record["readout"] == {"cam1": pytest.approx(readout)}
    assert [f["code"] for f in record["findings"] if "readout" in f["code"]] == ["readout-of-maker"]
    job.settings["readout_ms"] = {"cam1": 0.0}
    run(job)
    record = json.loads(Path(job.outputs["record"]).read_text())
    assert [f["code"] for f in record["findings"] if "readout" in f["code"]] == ["readout-disagrees"]
    assert "readout" not in record


LEANING = {"leaning": {"later": 0.5 / 480, "sd": 1e-5}, "video": {"width": 512, "height": 480}}


def test_targets_that_lean_show_a_rolling_shutter_in_a_plane(plane, tmp_path):
    job, reading = plane(scale=0.25, points=None, clip=None), str(tmp_path / "leaning.json")
    job.inputs["readings"] = [reading]
    for leaning, codes in ((LEANING, ["rolling-shutter"]), (LEANING | {"leaning": None}, [])):
        write_json(reading, leaning, {})
        run(job)
        found = json.loads(Path(job.outputs["record"]).read_text())["findings"]
        assert [f["code"] for f in found if f["code"] == "rolling-shutter"] == codes


def test_targets_that_lean_show_a_rolling_shutter_of_cameras_of_one_height(space, tmp_path):
    job, _ = space
    job.inputs["readings"] = [str(tmp_path / f"leaning{i}.json") for i in range(2)]
    for path in job.inputs["readings"]:
        write_json(path, LEANING, {})
    run(job)
    found = json.loads(Path(job.outputs["record"]).read_text())["findings"]
    assert [f["text"][:5] for f in found if f["code"] == "rolling-shutter"] == ["cam1:", "cam2:"]
    assert "as in 17" in next(f["text"] for f in found if f["code"] == "rolling-shutter")


@pytest.mark.parametrize(
    ("sensor", "file", "given", "aspect"),
    [
        ((8.8, 6.6), "1", None, 1.25),
        (None, "10/11", None, 10 / 11),
        ((8.8, 6.6), "10/11", None, 1.25),
        ((8.8, 6.6), "1", 1.1, 1.1),
        (None, "1", None, 1.0),
    ],
)
def test_the_shape_of_a_pixel_in_a_plane_is_the_configs_the_sensors_or_the_files(
    plane, tmp_path, sensor, file, given, aspect
):
    job = plane(scale=0.25, points=None, clip=None)
    job.settings["plane"]["aspect"] = given
    job.settings["sensor"] = sensor
    write_json(tmp_path / "r", {"video": {"width": 512, "height": 480, "sample_aspect": file}}, {})
    run(job)
    assert read_parquet(job.outputs["trajectories"])["x"].to_numpy() == pytest.approx(aspect * (100 + np.arange(N)) / 4)
    record = json.loads(Path(job.outputs["record"]).read_text())
    assert record["aspect"] == pytest.approx(aspect)
    noted = [f["text"] for f in record["findings"] if f["code"] == "plane-aspect"]
    assert len(noted) == (given is None and aspect != 1)


def test_a_part_of_the_picture_has_no_sensor_of_its_own(plane, tmp_path):
    job = plane(scale=0.25, points=None, clip=None)
    job.settings["plane"]["aspect"] = None
    job.settings.update(sensor=(8.8, 6.6), crop={"cam1": (0, 0, 400, 300)})
    write_json(tmp_path / "r", {"video": {"width": 400, "height": 300, "sample_aspect": "1"}}, {})
    run(job)
    assert json.loads(Path(job.outputs["record"]).read_text())["aspect"] == 1


def test_the_width_of_targets_is_compared_with_that_of_the_known_points(plane, tmp_path):
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(50, 450, 4), np.linspace(60, 400, 3)))
    known = pd.DataFrame({"Xf": x, "Yf": y, "tag": [f"p{i}" for i in range(12)], "x": x / 4, "y": -y / 4})
    write_parquet(tmp_path / "s", known.assign(z=0.0, clip="row1", width=9.0), units="in", provenance={})
    looks = {"time_s": [0.0] * 20, "Xf": [200.0] * 20, "Yf": [200.0] * 20, "width": [9.18] * 20}
    write_json(tmp_path / "r", {"image_size": [512, 480], "widths": {"t1": looks}}, {})
    job = plane(scale=None, points="calibration/points.csv", clip="row1")
    run(job)
    sizes = json.loads(Path(job.outputs["record"]).read_text())["sizes"]
    assert sizes["cam1"]["targets"]["t1"]["larger"] == pytest.approx(np.log(1.02))


@pytest.mark.parametrize(
    ("width", "same_balls", "held"), [(9.05, True, True), (9.05, False, False), (9.0, True, False)]
)
def test_a_zoom_that_the_width_of_targets_hints_at_is_held_in_sigma(plane, tmp_path, width, same_balls, held):
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(50, 450, 4), np.linspace(60, 400, 3)))
    known = pd.DataFrame({"Xf": x, "Yf": y, "tag": [f"p{i}" for i in range(12)], "x": x / 4, "y": -y / 4})
    write_parquet(tmp_path / "s", known.assign(z=0.0, clip="row1", width=9.0), units="in", provenance={})
    looks = {"time_s": [0.0] * 20, "Xf": [200.0] * 20, "Yf": [200.0] * 20, "width": [width] * 20}
    write_json(tmp_path / "r", {"image_size": [512, 480], "widths": {"t1": looks}}, {})
    job = plane(scale=None, points="calibration/points.csv", clip="row1")
    if not same_balls:
        job.settings["same_balls"] = False
    run(job)
    table = read_parquet(job.outputs["trajectories"])
    off = np.abs(table["x"] - 250 / 4).to_numpy() * np.log(9.05 / 9)  # about the middle of the points
    assert (table["sigma_x"].to_numpy() > 0.99 * off).all() == held
    codes = [finding["code"] for finding in json.loads(Path(job.outputs["record"]).read_text())["findings"]]
    assert ("zoom-in-sigma" in codes) == held

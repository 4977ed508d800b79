"""What config.yaml says of a run fits the recordings and files of its folder."""

import pytest

from tests.files.folders import problems, settings, spoil
from vidtrack.errors import VidtrackError
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import settings_from_config


def test_plane_mode_needs_one_camera_and_a_scale(folder):
    spoil(folder, "runs/pluck/cam2.MP4")
    assert "mode plane needs a scale" in problems(runs={"pluck": {"mode": "plane"}})[0]
    assert checked_experiment(settings(runs={"pluck": {"mode": "plane", "plane": {"scale": 0.1}}}))


WAVES = {"axes": {"waves": "+x", "up": "+z"}}
BODY = {"bodies": {"b": {"t1": [0, 0, 0], "t2": [1, 0, 0], "t3": [0, 1, 0]}}, "targets": ["t1", "t2", "t3"]}
SHORE = {"transects": {"mid": {"from": [0, 0, 0], "to": [1, 0, 0]}}}


@pytest.mark.parametrize(
    ("own", "says"),
    [
        ({"mode": "waterline"}, "runs.pluck.waterline: mode waterline needs transects"),
        ({**BODY, "analysis": "decay"}, "runs.pluck.axes: motions of a body need directions"),
        ({**BODY, **WAVES, "analysis": "decay"}, None),
        ({"targets": ["t1"], "bodies": BODY["bodies"]}, "runs.pluck.bodies.b.t2: no such target; known: t1."),
        ({"crop": {"cam1": [0, 0, 320, 240]}}, None),
        ({"crop": {"cam11": [0, 0, 320, 240]}}, "runs.pluck.crop.cam11: no such camera; did you mean 'cam1'?"),
        ({"rate": {"Cam2": 30}}, "runs.pluck.rate.Cam2: no such camera; did you mean 'cam2'?"),
        ({"stream": {"south": 1}}, "runs.pluck.stream.south: no such camera; known: cam1, cam2."),
        ({"videos": {"camm1": "x.mp4"}}, "runs.pluck.videos.camm1: no such camera; did you mean 'cam1'?"),
        ({"reference": {"value": "x_in", "target": "t9"}}, "reference.target: no target 't9'; known: t1"),
        ({"channels": {"file": "g.csv", "columns": {"eta": "v"}}}, "channels.file: no such file as runs/pluck/g.csv"),
        ({"waterline": SHORE}, None),
        ({"waterline": {**SHORE, "camera": "cam9"}}, "waterline.camera: cam9 has no recording in this run"),
        (
            {"waterline": {"transects": {"mid": {"from": [0, 0, 0], "to": [1, 0, 0], "profile": "no.csv"}}}},
            "waterline.transects.mid.profile: no such file as no.csv",
        ),
        ({"reference": {"value": "x_mm"}}, "reference.value: runs/pluck/reference.csv has no column 'x_mm'"),
        ({"reference": {"value": "x_in", "time": "t"}}, "reference.time: runs/pluck/reference.csv has no column 't'"),
        ({"reference": {"value": "X_IN"}}, None),
    ],
)  # fmt: skip
def test_what_a_run_s_settings_lack_is_said_where_they_stand(folder, own, says):
    if says is None:
        assert checked_experiment(settings(runs={"pluck": own}))
        return
    assert says in "".join(problems(runs={"pluck": own}))


def test_the_basin_s_directions_hold_for_runs_that_name_none_of_their_own(folder):
    assert checked_experiment(settings(runs={"pluck": {**BODY, "analysis": "decay"}}, **WAVES))


def test_a_reference_that_the_config_describes_must_lie_in_the_folder(folder):
    spoil(folder, "runs/pluck/reference.csv")
    assert "there is no reference.csv" in problems(runs={"pluck": {"reference": {"value": "x_in"}}})[0]


def test_known_points_of_a_plane_need_the_clip_that_shows_them(folder):
    spoil(folder, "runs/pluck/cam2.MP4")
    plane = {"points": "calibration/points.csv", "clip": "row9"}
    assert "plane.clip: row9 is no clip" in problems(runs={"pluck": {"mode": "plane", "plane": plane}})[0]
    plane["clip"] = "row1"
    assert checked_experiment(settings(runs={"pluck": {"mode": "plane", "plane": plane}}))


def test_a_camera_that_follows_the_water_needs_a_calibration_clip(folder):
    spoil(folder, "calibration/row1/cam1.mov")
    spoil(folder, "calibration/row1/picks.csv")
    own = {"mode": "waterline", "waterline": {**SHORE, "camera": "cam1"}}
    assert "waterline: camera cam1 has no calibration clip" in "".join(problems(runs={"pluck": own}))


def test_a_word_of_the_run_on_the_camera_in_a_file_cannot_hold_for_two_cameras(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs/pluck").mkdir(parents=True)
    (tmp_path / "runs/pluck/both.csv").write_text("t1_cam1_U,t1_cam1_V,t1_cam2_U,t1_cam2_V\n1,2,3,4\n")
    both = "runs/pluck/both.csv"
    own = {"videos": {"cam1": both, "cam2": both}, "tracks": {"camera": "cam1"}}
    config = {"units": "in", "cameras": {"cam1": {}, "cam2": {}}, "runs": {"pluck": own}}

    def said():
        with pytest.raises(VidtrackError) as refusal:
            checked_experiment(settings_from_config(config))
        return [line for line in refusal.value.problems if "tracks.camera" in line]

    (line,) = said()
    assert "cam1 and cam2 one and the same" in line
    own["tracks"] = {"size": [320, 240]}
    assert not said()

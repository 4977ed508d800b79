"""Every problem of a folder and its config shows before work begins, on one line each."""

import pytest

from tests.files.folders import problems, settings, spoil
from vidtrack.files.experiment import awaited_runs
from vidtrack.files.experiment_checks import checked_experiment


@pytest.mark.parametrize(
    ("path", "text", "says"),
    [
        ("runs/pluck/cam2.MP4", None, "runs/pluck: only camera cam1 has a recording, and mode space needs two"),
        ("runs/pluck/cma1.mov", "v", "runs/pluck/cma1.mov: config.yaml names no camera 'cma1'; did you mean 'cam1'?"),
        ("runs/pluck/cam1.avi", "v", "cam1.mov: camera cam1 has another recording here, runs/pluck/cam1.avi"),
        ("runs/empty/notes.txt", "v", "runs/empty: no recording of any camera"),
        (
            "runs/day1/third/cam1.mov",
            "v",
            "runs/day1: no recording of any camera (cam1, cam2). Move its folders (third) to",
        ),
        ("runs/cam1.mov", "v", "runs/cam1.mov: nothing reads it here. Move it to runs/<run>/cam1.mov."),
        ("calibration/cam1.mov", "v", "calibration/cam1.mov: nothing reads it here. Move it to calibration/<clip>/"),
        ("calibration/day1/row2/cam1.mov", "v", "calibration/day1: no recording of any camera, but folders (row2)."),
        ("calibration/points.csv", None, "calibration/points.csv: no such file"),
        ("calibration/points.csv", "tag,x,y,z\n1,0,0,0\n1,1,1,1\n", "line 3: tag 1 appears twice (also line 2)"),
        ("calibration/points.csv", "tag,x,y,z\n1,0,zero,0\n", "line 2: y is 'zero', not a number"),
        ("calibration/row1/cam2.mov", None, "runs/pluck: camera cam2 has no calibration clip"),
        ("calibration/row1/picks.csv", "camera,tag,Xf,Yf\ncam1,99,1,1\n", "line 2: clip row1 shows no tag 99"),
        ("calibration/row1/picks.csv", "camera,tag,Xf,Yf\ncam9,1,1,1\n", "line 2: config.yaml names no camera cam9"),
    ],
)
def test_a_problem_in_the_folder_is_one_line(folder, path, text, says):
    spoil(folder, path, text)
    lines = problems()
    assert len(lines) == 1
    assert says in lines[0]


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"experiment": "nowhere"}, "experiment: no such folder as 'nowhere'"),
        ({"calibration": {"clips": {"rwo1": {}}}}, "clips.rwo1: no such folder in calibration/; did you mean 'row1'?"),
        ({"calibration": {"clips": {"row1": {"tags": "1-9"}}}}, "row1.tags: tag 9 is not in calibration/points.csv"),
        ({"calibration": {"clips": {"row1": {"tags": "1, 2, 2"}}}}, "row1.tags: tag 2 appears twice"),
        ({"runs": {"plukc": {}}}, "runs.plukc: no such folder in runs/; did you mean 'pluck'?"),
        ({"runs": {"pluck": {"reference": {"value": "x"}}}}, "runs/pluck/reference.csv has no column 'x'"),
        ({"runs": {"pluck": {"reference": {"value": "x_in", "target": "ball"}}}}, "no target 'ball'; known: t1"),
        ({"runs": {"pluck": {"mode": "plane", "plane": {"scale": 1}}}}, "mode plane uses one camera"),
        ({"runs": {"pluck": {"bodies": {"b": {"t1": [0, 0, 0]}}}}}, "1 targets; six degrees of freedom need three"),
        ({"runs": {"pluck": {"videos": {"cam1": "no.mov"}}}}, "runs.pluck.videos.cam1: no such file as no.mov"),
    ],
)  # fmt: skip
def test_a_config_that_does_not_fit_the_folder_is_one_line(folder, changes, says):
    lines = problems(**changes)
    assert len(lines) == 1
    assert says in lines[0]


def test_many_problems_are_told_at_once(folder):
    spoil(folder, "runs/pluck/cam2.MP4")
    spoil(folder, "calibration/row1/picks.csv", "camera,tag,Xf,Yf\ncam1,77,1,1\n")
    assert len(problems()) == 2


def test_a_unit_in_a_header_is_held_against_the_configs(folder):
    spoil(folder, "calibration/points.csv", "tag,x (mm),y (mm),z (mm)\n1,0,0,0\n")
    spoil(folder, "runs/pluck/truth.csv", "time_s,target,x_mm,y_mm,z_mm\n0,t1,0,0,0\n")
    first, second = problems()
    assert "is in mm, but config.yaml says units: in" in first
    assert second.startswith("runs/pluck/truth.csv, line 1")
    assert "x_in of runs/pluck/reference.csv is in in, but units is mm" in "".join(
        problems(units="mm", runs={"pluck": {"reference": {"value": "x_in"}}})
    )


def test_a_run_that_is_still_to_be_made_stops_nothing_where_it_cannot_be_another_one(folder):
    named = {"pluck": {}, "later": {"targets": 3}}
    assert awaited_runs(settings(runs=named), checked_experiment(settings(runs=named))) == ["later"]
    (folder / "runs" / "layter").mkdir()
    (folder / "runs" / "layter" / "cam1.mov").write_bytes((folder / "runs/pluck/cam1.mov").read_bytes())
    assert "runs.later: no such folder in runs/; did you mean 'layter'?" in problems(runs=named)[0]


def test_tags_with_hyphens_are_those_of_the_points(folder):
    spoil(folder, "calibration/points.csv", "tag,x,y,z\n1-1,0,0,0\n2-1,1,0,0\n")
    spoil(folder, "calibration/row1/picks.csv")
    assert checked_experiment(settings(calibration={"clips": {"row1": {"tags": "1-1, 2-1"}}}))


def test_a_tag_that_a_spreadsheet_made_a_date_is_recognised(folder):
    spoil(folder, "calibration/points.csv", "tag,x,y,z\n01-Jan,0,0,0\n01-Feb,1,0,0\n")
    spoil(folder, "calibration/row1/picks.csv")
    (line, *_) = problems(calibration={"clips": {"row1": {"tags": ["1/1"]}}})
    assert "tag 1/1 is not in calibration/points.csv, but '01-Jan', which may be the same" in line


def test_many_tags_that_are_written_otherwise_are_one_line(folder):
    rows = "".join(f"{n:02d},{n},0,0\n" for n in range(1, 13))
    spoil(folder, "calibration/points.csv", f"tag,x,y,z\n{rows}")
    spoil(folder, "calibration/row1/picks.csv")
    (line,) = problems(calibration={"clips": {"row1": {"tags": [str(n) for n in range(1, 10)] + ["77", "78"]}}})[:-1]
    assert "tags 1, 2, 3, 4 and 5 more are not in calibration/points.csv, but '01', '02', '03', '04' and 5 more" in line
    (line,) = problems(calibration={"clips": {"row1": {"tags": ["01", "77", "78"]}}})
    assert "tags 77, 78 are not in calibration/points.csv. Add the points there" in line


def test_points_that_are_counted_from_0_and_clips_from_1_are_recognised(folder):
    rows = "".join(f"{n},{n},0,0\n" for n in range(6))
    spoil(folder, "calibration/points.csv", f"tag,x,y,z\n{rows}")
    spoil(folder, "calibration/row1/picks.csv")
    (line, *_) = problems(calibration={"clips": {"row1": {"tags": "1-6"}}})
    assert "tag 6 is not in calibration/points.csv. calibration/points.csv counts from 0: if this clip counts" in line
    spoil(folder, "calibration/points.csv", "tag,x,y,z\n" + rows.partition("\n")[2])
    (line, *_) = problems(calibration={"clips": {"row1": {"tags": "0-5"}}})
    assert "calibration/points.csv counts from 1" in line


def test_very_many_problems_of_one_kind_are_counted(folder):
    spoil(folder, "calibration/row1/picks.csv", "camera,tag,Xf,Yf\n" + "".join(f"cam1,q{n},1,1\n" for n in range(47)))
    lines = problems()
    assert len(lines) == 11
    assert "37 more" in lines[-1]


PANE = {"window": {"point": [0, 0, 0], "normal": [0, 1, 0], "thickness": 1, "indices": [1.0, 1.49, 1.333]}}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"cameras": {"cam1": {"through": "window"}, "cam2": {}}, "interfaces": PANE},
            "cam1.through: a wand calibrates no camera that looks through an interface (window)",
        ),
        ({"lens": {"fx": 900, "fy": 900}}, "calibration.lens: a wand finds the lens of cam1 itself"),
        (
            {"cameras": {"cam1": {"calibration": {"model": "fisheye"}}, "cam2": {}}},
            "those of a wand have one lens model, not auto, fisheye",
        ),
    ],
)
def test_what_a_wand_cannot_calibrate_is_refused_before_any_work(folder, changes, says):
    spoil(folder, "calibration/wand/cam1.mov", "v")
    spoil(folder, "calibration/wand/cam2.mov", "v")
    own = {"wand": {"lengths": {"A-B": 20}}} | ({"lens": changes.pop("lens")} if "lens" in changes else {})
    assert any(says in line for line in problems(calibration=own, **changes))


FLOAT = {"t1": [0, 0, 0], "t2": [9, 0, 0], "t3": [0, 9, 0]}


@pytest.mark.parametrize(
    ("own", "runs", "says"),
    [
        ({"body": "float"}, {}, "calibration.self.body: no run has a body float"),
        ({"body": "float", "runs": ["plukc"]}, {"pluck": {"bodies": {"float": FLOAT}}}, "no folder plukc in runs/"),
        ({"body": "float", "runs": ["pluck"]}, {"pluck": {}}, "run pluck has no body float"),
        ({"body": "float"}, {"pluck": {"mode": "plane", "bodies": {"float": FLOAT}}}, "a body refines cameras in mode"),
    ],
)
def test_a_body_that_cannot_refine_the_cameras_is_refused_before_any_work(folder, own, runs, says):
    runs = {name: {"targets": 3} | run for name, run in runs.items()}
    assert any(says in line for line in problems(calibration={"self": own}, runs=runs))


@pytest.mark.parametrize(("wanted", "named"), [("calibration", "calib"), ("runs", "run"), ("runs", "Runs")])
def test_a_folder_that_is_named_nearly_as_it_should_be_is_one_line(folder, wanted, named):
    (folder / wanted).rename(folder / named)
    lines = problems()
    assert f"{wanted}/: no such folder; did you mean {named!r}? Rename it to {wanted}." in lines
    assert not any("no such folder in" in line for line in lines)


def test_a_recording_that_the_config_names_may_lie_anywhere(folder):
    (folder / "runs/pluck/cam1.mov").rename(folder / "runs/cam1.mov")
    assert checked_experiment(settings(runs={"pluck": {"videos": {"cam1": "runs/cam1.mov"}}}))


def test_a_target_that_one_camera_s_boxes_lack_is_named_before_any_work(folder):
    spoil(folder, "runs/pluck/targets.csv", "camera,target,Xf,Yf\ncam1,ball,9,9\ncam2,Ball,9,9\n")
    first, second = problems()
    assert first == (
        "runs/pluck/targets.csv: camera cam1 has start boxes of ball, and none of Ball. A target has one name in all "
        "cameras and in config.yaml: correct it, or add the row."
    )
    assert "camera cam2 has start boxes of Ball, and none of ball." in second
    spoil(folder, "runs/pluck/targets.csv", "camera,target,Xf,Yf\ncam1,ball,9,9\n")
    assert checked_experiment(settings())
    assert "and none of float" in problems(runs={"pluck": {"targets": ["float"]}})[0]

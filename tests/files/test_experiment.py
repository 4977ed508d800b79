"""Discovery, checks and orders on folders that need no real video: nothing is opened before work begins."""

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.experiment_checks import checked_experiment
from vidtrack.settings.config import settings_from_config
from vidtrack.workflow import orders
from vidtrack.workflow.order_book import OrderBook


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path, text in {
        "calibration/points.csv": "tag,x,y,z\n" + "".join(f"{n},{n},0,0\n" for n in range(1, 9)),
        "calibration/row1/cam1.mov": "video",
        "calibration/row1/cam2.mov": "video",
        "calibration/row1/picks.csv": "camera,tag,Xf,Yf\ncam1,1,10,20\n",
        "runs/pluck/cam1.mov": "video",
        "runs/pluck/cam2.MP4": "video",
        "runs/pluck/reference.csv": "time_s,x_in\n0,1\n",
        "runs/pluck/notes.txt": "a windy day",
    }.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    return tmp_path


def settings(**changes):
    return settings_from_config({"units": "in", "cameras": {"cam1": {}, "cam2": {}}, **changes})


def problems(**changes):
    with pytest.raises(VidtrackError) as caught:
        checked_experiment(settings(**changes))
    return list(caught.value.problems)


def test_what_lies_in_the_folder_is_found(folder):
    found = checked_experiment(settings())
    assert found.clips["row1"].videos == {"cam1": "calibration/row1/cam1.mov", "cam2": "calibration/row1/cam2.mov"}
    assert found.runs["pluck"].videos == {"cam1": "runs/pluck/cam1.mov", "cam2": "runs/pluck/cam2.MP4"}
    assert found.runs["pluck"].reference == "runs/pluck/reference.csv"
    assert found.results == "results"


def test_a_recording_elsewhere_is_found_by_its_path(folder):
    (folder / "tape").mkdir()
    (folder / "tape/a.avi").write_text("video")
    found = checked_experiment(settings(runs={"far": {"videos": {"cam1": "tape/a.avi", "cam2": "tape/a.avi"}}}))
    assert found.runs["far"].videos["cam1"] == "tape/a.avi"


def spoil(folder, path, text=None):
    target = folder / path
    target.parent.mkdir(parents=True, exist_ok=True)
    if text is None:
        target.unlink()
    else:
        target.write_text(text)


@pytest.mark.parametrize(
    ("path", "text", "says"),
    [
        ("runs/pluck/cam2.MP4", None, "runs/pluck: only camera cam1 has a recording, and mode space needs two"),
        ("runs/pluck/cma1.mov", "v", "runs/pluck/cma1.mov: config.yaml names no camera 'cma1'; did you mean 'cam1'?"),
        ("runs/pluck/cam1.avi", "v", "cam1.mov: camera cam1 has another recording here, runs/pluck/cam1.avi"),
        ("runs/empty/notes.txt", "v", "runs/empty: no recording of any camera"),
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


def test_plane_mode_needs_one_camera_and_a_scale(folder):
    spoil(folder, "runs/pluck/cam2.MP4")
    assert "mode plane needs a scale" in problems(runs={"pluck": {"mode": "plane"}})[0]
    assert checked_experiment(settings(runs={"pluck": {"mode": "plane", "plane": {"scale": 0.1}}}))


def test_many_problems_are_told_at_once(folder):
    spoil(folder, "runs/pluck/cam2.MP4")
    spoil(folder, "calibration/row1/picks.csv", "camera,tag,Xf,Yf\ncam1,77,1,1\n")
    assert len(problems()) == 2


def orders_of(**changes):
    """Every order of the experiment, by its job."""
    these = settings(**changes)
    found = checked_experiment(these)
    run = found.runs["pluck"]
    book = OrderBook(".", cache=".cache")
    book.add("track", orders.track(these, found, "pluck", "cam1"), [run.videos["cam1"]], "pluck", "cam1")
    book.add("calibrate", orders.calibrate(these, "cam1"), [], "cam1")
    book.add("calibrate", orders.calibrate(these, "cam2"), [], "cam2")
    book.add("calibration_points", orders.calibration_points(these, found, "cam1"), [], "cam1")
    book.add("locate", orders.locate(these, found, "pluck"), [], "pluck")
    book.add("compare", orders.compare(these, found, "pluck"), [run.reference], "pluck")
    return {" ".join(key): book.order(*key) for key in book.jobs}


def changed(before, after):
    return sorted(job for job in after if before[job] != after[job])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "touched"),
    [
        ({"cameras": {"cam1": {"Cx": 250}, "cam2": {}}}, ["calibrate cam1"]),
        ({"runs": {"pluck": {"threshold": 90}}}, ["track pluck cam1"]),
        ({"calibration": {"refine": "linear"}}, ["calibrate cam1", "calibrate cam2"]),
        ({"calibration": {"clips": {"row1": {"tags": "1-8"}}}}, []),
        ({"cameras": {"cam2": {}, "cam1": {}}}, []),
        ({"cameras": {"cam1": {"clock": {"offset_s": 1}}, "cam2": {}}}, ["locate pluck"]),
        ({"runs": {"pluck": {"reference": {"value": "x_in", "axis": "y"}}}}, ["compare pluck"]),
    ],
)
def test_a_setting_touches_the_orders_of_its_rules_alone(folder, changes, touched):
    assert changed(orders_of(), orders_of(**changes)) == touched


def test_asking_for_orders_writes_nothing(folder):
    before = sorted(folder.rglob("*"))
    orders_of()
    assert sorted(folder.rglob("*")) == before


@pytest.mark.slow
def test_an_edited_recording_is_seen_and_a_touched_one_is_not(folder):
    before = orders_of()
    (folder / "runs/pluck/cam1.mov").write_text("video")
    assert changed(before, orders_of()) == []
    (folder / "runs/pluck/cam1.mov").write_text("other")
    assert changed(before, orders_of()) == ["track pluck cam1"]


@pytest.mark.parametrize(
    "name", ["Thumbs.db", ".DS_Store", "._cam1.mov", "cam1.SRT", "cam1.THM", "cam1.XML", "cam1.cih"]
)
def test_files_that_systems_and_cameras_leave_are_no_recordings(folder, name):
    (folder / "runs/pluck" / name).write_text("x")
    (folder / "runs/__MACOSX").mkdir()
    assert checked_experiment(settings()).runs["pluck"].videos["cam1"] == "runs/pluck/cam1.mov"


def test_a_recording_behind_a_broken_link_is_an_error_and_no_missing_camera(folder):
    (folder / "calibration/row1/cam3.mov").write_text("video")
    (folder / "runs/pluck/cam3.mov").symlink_to(folder / "disk/cam3.mov")
    (line,) = problems(cameras={"cam1": {}, "cam2": {}, "cam3": {}})
    assert line.startswith("runs/pluck/cam3.mov: a link to ")


def test_runs_whose_names_differ_in_capitals_alone_are_told(folder):
    for camera in ("cam1", "cam2"):
        spoil(folder, f"runs/PLUCK/{camera}.mov", "video")
    assert problems() == ["runs: PLUCK and pluck differ in capitals alone. Rename one of them."]


def test_a_table_under_another_name_is_told_and_not_passed_over(folder):
    spoil(folder, "calibration/row1/picks.csv")
    spoil(folder, "calibration/row1/Picks.csv", "camera,tag,Xf,Yf\n")
    assert "Picks.csv: only picks.csv is read" in problems()[0]


def test_a_unit_in_a_header_is_held_against_the_configs(folder):
    spoil(folder, "calibration/points.csv", "tag,x (mm),y (mm),z (mm)\n1,0,0,0\n")
    spoil(folder, "runs/pluck/truth.csv", "time_s,target,x_mm,y_mm,z_mm\n0,t1,0,0,0\n")
    first, second = problems()
    assert "is in mm, but config.yaml says units: in" in first
    assert second.startswith("runs/pluck/truth.csv, line 1")
    assert "x_in of runs/pluck/reference.csv is in in, but units is mm" in "".join(
        problems(units="mm", runs={"pluck": {"reference": {"value": "x_in"}}})
    )


def test_tags_with_hyphens_are_those_of_the_points(folder):
    spoil(folder, "calibration/points.csv", "tag,x,y,z\n1-1,0,0,0\n2-1,1,0,0\n")
    spoil(folder, "calibration/row1/picks.csv")
    assert checked_experiment(settings(calibration={"clips": {"row1": {"tags": "1-1, 2-1"}}}))


def test_a_tag_that_a_spreadsheet_made_a_date_is_recognised(folder):
    spoil(folder, "calibration/points.csv", "tag,x,y,z\n01-Jan,0,0,0\n01-Feb,1,0,0\n")
    spoil(folder, "calibration/row1/picks.csv")
    (line, *_) = problems(calibration={"clips": {"row1": {"tags": ["1/1"]}}})
    assert "'01-Jan' there may be it, as a spreadsheet changed it" in line


def test_very_many_problems_of_one_kind_are_counted(folder):
    spoil(folder, "calibration/row1/picks.csv", "camera,tag,Xf,Yf\n" + "".join(f"cam1,q{n},1,1\n" for n in range(47)))
    lines = problems()
    assert len(lines) == 11
    assert "37 more" in lines[-1]

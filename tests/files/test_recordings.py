import os

import pytest

from vidtrack.files.recordings import Recording, of_folder, of_pattern, recordings_in

CAMERAS = ["cam1", "cam10", "left"]


def made(folder, *names):
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x")
    return str(folder)


def look(folder, *names):
    problems = []
    found = recordings_in(made(folder, *names), CAMERAS, problems)
    short = {c: [os.path.relpath(p, folder) for p in one.files] for c, one in found.items()}
    return short, {c: one.numbered for c, one in found.items()}, problems


def test_a_file_a_camera(tmp_path):
    assert look(tmp_path, "cam1.mov", "left.MP4", "notes.txt")[0] == {"cam1": ["cam1.mov"], "left": ["left.MP4"]}


@pytest.mark.parametrize("form", ["cam1_{}.mp4", "cam1-{}.mp4", "cam1 ({}).mp4", "cam1.{}.mp4"])
def test_numbered_videos_are_one_recording_in_the_order_of_their_numbers(tmp_path, form):
    names = [form.format(k) for k in (1, 2, 10)]
    found, numbered, problems = look(tmp_path, *reversed(names), "cam10.mp4")
    assert found == {"cam1": names, "cam10": ["cam10.mp4"]}
    assert not any(numbered.values())
    assert problems == []


def test_numbered_pictures_are_a_recording_of_the_camera_whose_name_fits_best(tmp_path):
    names = [f"cam10_{k}.png" for k in range(12)]
    found, numbered, problems = look(tmp_path, *names)
    assert found == {"cam10": names}
    assert numbered == {"cam10": True}
    assert problems == []


@pytest.mark.parametrize(
    ("names", "order"),
    [
        (["GX020001.MP4", "GX010001.MP4", "GX030001.MP4"], ["GX010001.MP4", "GX020001.MP4", "GX030001.MP4"]),
        (["GP010042.MP4", "GOPR0042.MP4", "GP020042.MP4"], ["GOPR0042.MP4", "GP010042.MP4", "GP020042.MP4"]),
        (["00010.MTS", "00009.MTS"], ["00009.MTS", "00010.MTS"]),
        (["x.avi"], ["x.avi"]),
    ],
)
def test_a_folder_a_camera_holds_one_recording_in_as_many_files_as_it_has(tmp_path, names, order):
    litter = ["Thumbs.db", ".DS_Store", "._GX010001.MP4", "GX010001.THM", "GL010001.LRV", "a.srt", "C0001M01.XML"]
    found, _, problems = look(tmp_path, *(f"cam1/{name}" for name in [*names, *litter]))
    assert found == {"cam1": [f"cam1/{name}" for name in order]}
    assert problems == []


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["GX010001.MP4", "GX010002.MP4"], "chapters of 2 recordings"),
        (["a_1.png", "b_1.png"], "b_1.png is not numbered as a_1.png is"),
        (["a_1.mov", "a_2.avi"], "files of several kinds"),
        (["notes.txt"], "no recording in this folder"),
    ],
)
def test_a_folder_of_several_recordings_or_of_none_is_named(tmp_path, names, said):
    problems = []
    assert of_folder(made(tmp_path, *names), problems) is None
    assert len(problems) == 1
    assert said in problems[0]


def test_a_file_and_a_folder_of_one_camera_are_two_recordings(tmp_path):
    found, _, problems = look(tmp_path, "cam1.mov", "cam1/a.mov")
    assert found == {"cam1": ["cam1.mov"]}
    assert "camera cam1 has another recording here" in problems[0]


def test_a_pattern_names_numbered_pictures(tmp_path):
    made(tmp_path, "far/s1_1.tif", "far/s1_2.tif", "far/s2_1.tif")
    problems = []
    one = of_pattern(f"{tmp_path}/far/s1_*.tif", problems, "config.yaml: runs.r1.videos.cam1")
    assert one == Recording(f"{tmp_path}/far/s1_1.tif", (f"{tmp_path}/far/s1_2.tif",), numbered=True)
    assert of_pattern(f"{tmp_path}/far/s3_*.tif", problems, "here") is None
    assert "here: no file is named as" in problems[0]


def test_parts_are_paths_from_the_folder_of_the_first_file():
    assert Recording("a/b/1.mts", ("a/b/2.mts", "c/3.mts")).parts == ["2.mts", "../../c/3.mts"]
    assert Recording("a/1.png", ("a/2.png",), numbered=True).parts == []


def test_a_numbered_name_beside_the_cameras_own_file_is_a_stranger(tmp_path):
    found, _, problems = look(tmp_path, "cam1.mov", "cam1_2.mov")
    assert found == {"cam1": ["cam1.mov"]}
    assert "cam1_2" in problems[0]


def test_a_name_is_a_camera_s_as_it_looks(tmp_path):
    assert look(tmp_path, "cam1 .mov", "left\u200b.mp4")[0] == {"cam1": ["cam1 .mov"], "left": ["left\u200b.mp4"]}


def test_a_second_recording_of_a_camera_is_called_so(tmp_path):
    (line,) = look(tmp_path, "cam1.mov", "cam1-2.mov")[2]
    assert line.endswith(
        "cam1-2.mov: camera cam1 has another recording here, "
        f"{tmp_path}/cam1.mov. Keep one; or, where one goes on where the other ends, name them cam1_1, cam1_2."
    )

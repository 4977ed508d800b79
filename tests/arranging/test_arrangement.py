import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.arranging.arrangement import Wishes, arranged
from vidtrack.arranging.inventory import Recording


def recordings(*paths):
    return [Recording(p, (p,), "still" if p.endswith((".png", ".jpg")) else "video") for p in paths]


def proposed(*paths, wishes=None):
    """{kind: {take: {camera: path}}}."""
    found = arranged(recordings(*paths), wishes or Wishes())
    assert not found.left
    return {
        kind: {take.name: {c: r.path for c, r in take.recordings.items()} for take in found.of(kind)}
        for kind in ("calibration", "run")
    }


@pytest.mark.parametrize(
    ("paths", "cameras", "clips", "runs"),
    [
        (["left/pluck.mp4", "right/pluck.mp4", "left/calib.mp4", "right/calib.mp4"], "left right", "calib", "pluck"),
        (["pluck_cam1.mp4", "pluck_cam2.mp4", "calib_cam1.png", "calib_cam2.png"], "cam1 cam2", "calib", "pluck"),
        (["cam 1/run 1.mp4", "cam 2/run 1.mp4", "cam 1/calibration.mp4", "cam 2/calibration.mp4"],
         "cam_1 cam_2", "calibration", "run1"),
        (["wave 3/1.mov", "wave 3/2.mov", "calibration/1.jpg", "calibration/2.jpg"],
         "cam1 cam2", "calibration", "wave_3"),
        (["A/swing1.avi", "B/swing1.avi", "A/swing2.avi", "B/swing2.avi", "A/dots.avi", "B/dots.avi"],
         "A B", "dots", "swing1 swing2"),
        (["d_east_heave.mp4", "d_west_heave.mp4", "d_east_balls.mp4", "d_west_balls.mp4"],
         "east west", "d-balls", "d-heave"),
        (["Camera1.mp4", "Camera2.mp4", "Camera3.mp4"], "Camera1 Camera2 Camera3", "", "run1"),
        (["calibration/row1/cam_left.mov", "calibration/row1/cam_right.mov", "runs/my-test/cam_left.mov"],
         "cam_left cam_right", "row1", "my-test"),
        ([f"sony-{side}/PRIVATE/M4ROOT/CLIP/C000{i}.MP4" for side in ("links", "rechts") for i in (1, 2)],
         "sony-links sony-rechts", "", "C0001 C0002"),
        (["stills/L.jpg", "stills/R.jpg", "L_wave1.mp4", "R_wave1.mp4", "L_wave2.mp4", "R_wave2.mp4"],
         "L R", "stills", "wave1 wave2"),
        ([f"Becken Süd/{side}/{name}.MOV" for side in "LR" for name in ("Versuch 1", "Kalibrierung")],
         "L R", "Kalibrierung", "Versuch-1"),
        ([f"high speed/{c}/{take}/{take}.avi" for c in ("C1", "C2") for take in ("cal", "drop1")],
         "C1 C2", "cal", "drop1"),
        (["test1/cam1.mp4", "test1/cam2.mp4"], "cam1 cam2", "", "test1"),
    ],
)  # fmt: skip
def test_cameras_clips_and_runs_are_found_in_what_people_name_their_files(paths, cameras, clips, runs):
    found = arranged(recordings(*paths))
    assert found.cameras == cameras.split()
    assert [take.name for take in found.of("calibration")] == clips.split()
    assert [take.name for take in found.of("run")] == runs.split()
    assert not found.left


@pytest.mark.parametrize("card", ["PRIVATE/AVCHD/BDMV/STREAM", "DCIM/100GOPRO", "DCIM/100MEDIA", "PRIVATE/M4ROOT/CLIP"])
def test_folders_of_a_cameras_card_say_nothing(card):
    names = ["00001.MTS", "00002.MTS"]
    found = arranged(recordings(*(f"{camera}/{card}/{name}" for camera in ("left", "right") for name in names)))
    assert found.cameras == ["left", "right"]
    assert [take.name for take in found.of("run")] == ["00001", "00002"]


def test_names_without_anything_in_common_are_paired_by_order_and_that_is_said():
    found = arranged(recordings("GoPro1/GX42.MP4", "GoPro1/GX43.MP4", "GoPro2/GX100.MP4", "GoPro2/GX101.MP4"))
    assert found.of("run")[1].recordings["GoPro2"].path == "GoPro2/GX101.MP4"
    assert "order of their names" in found.notes[0]


def test_two_makes_of_cameras_with_their_own_cards_are_paired_stills_with_stills():
    paths = ["nikon/DCIM/101NIKON/DSC_0004.MOV", "nikon/DCIM/101NIKON/DSC_0005.jpg"]
    paths += ["canon/DCIM/100CANON/IMG_0120.jpg", "canon/DCIM/100CANON/MVI_0121.MOV"]
    found = proposed(*paths)
    assert found["run"] == {"take1": {"nikon": paths[0], "canon": paths[3]}}
    assert found["calibration"] == {"take2": {"nikon": paths[1], "canon": paths[2]}}


@pytest.mark.parametrize(
    "pattern",
    [
        "NVR_ch{c}_main_2026031410{m:02d}{s:02d}_20260314110000.mp4",
        "ch{c}/2026-03-14_10-{m:02d}-{s:02d}_main.mp4",
        "{m}/cam{c}_20260314T10{m:02d}{s:02d}.avi",
    ],
)
def test_recordings_that_began_together_by_the_times_in_their_names_are_one_take(pattern):
    began = [(c, m, 2 * c + m) for c in (1, 2, 3) for m in (7, 21)]
    found = arranged(recordings(*(pattern.format(c=c, m=m, s=s) for c, m, s in began)))
    assert len(found.cameras) == 3
    assert [len(take.recordings) for take in found.takes] == [3, 3]
    assert not found.left
    assert any("times in their names" in note for note in found.notes)


def test_takes_of_one_camera_that_follow_each_other_at_once_are_kept_apart():
    found = arranged(recordings(*(f"cam{c}_20260314_1000{s + c:02d}.mp4" for c in (1, 2) for s in (10, 20, 30))))
    assert [len(take.recordings) for take in found.takes] == [2, 2, 2]


def test_one_recording_is_a_run_of_one_camera_and_that_is_said():
    found = arranged(recordings("toss.mp4"))
    assert (found.cameras, found.of("run")[0].name) == (["cam1"], "toss")
    assert found.notes


def test_two_recordings_for_one_place_are_not_merged_silently():
    found = arranged(recordings("runs/a/cam1.mov", "runs/a/cam2.mov", "runs/a/cam1.mp4"))
    assert [recording.path for recording, _ in found.left] == ["runs/a/cam1.mp4"]
    assert "has runs/a/cam1.mov for cam1 already" in found.left[0][1]


def test_what_a_person_says_counts_before_what_is_guessed():
    wishes = Wishes([("near", "x*"), ("far", "y*")], [("board", "*7.mp4")], [("drop", "*8.mp4")])
    found = proposed("x7.mp4", "y7.mp4", "x8.mp4", "y8.mp4", wishes=wishes)
    assert found == {
        "calibration": {"board": {"far": "y7.mp4", "near": "x7.mp4"}},
        "run": {"drop": {"far": "y8.mp4", "near": "x8.mp4"}},
    }


NAMES = st.lists(st.sampled_from(["pluck", "forced", "heave", "roll", "wave12", "still"]), min_size=1, unique=True)


@given(NAMES, st.integers(2, 5), st.sampled_from(["{c}/{t}.mp4", "{t}/{c}.mp4", "{t}_{c}.mp4", "{c}-{t}.mp4"]))
def test_every_regular_arrangement_gives_all_cameras_in_every_take(takes, n, pattern):
    cameras = [f"cam{i + 1}" for i in range(n)]
    paths = [pattern.format(c=c, t=t).replace("/", os.sep) for c in cameras for t in takes]
    found = arranged(recordings(*paths))
    assert found.cameras == cameras
    assert sorted(take.name for take in found.takes) == sorted(takes)
    assert all(list(take.recordings) == cameras for take in found.takes)

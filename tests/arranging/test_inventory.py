import os

from vidtrack.arranging.inventory import joined, recordings_in


def test_numbered_pictures_are_one_recording_and_a_few_are_stills():
    pictures = [f"img_{n:04d}.tif" for n in range(12)]
    (one,) = joined(pictures)
    assert (one.kind, len(one.parts), one.path) == ("pictures", 12, "img_0000.tif")
    assert [r.kind for r in joined(["img_1.png", "img_2.png"])] == ["still", "still"]


def test_pictures_are_ordered_by_number_without_leading_zeros_too():
    (one,) = joined([f"f{n}.png" for n in range(1, 13)])
    assert one.parts[-1] == "f12.png"


def test_chapters_of_one_recording_are_joined_and_other_recordings_are_not():
    found = joined(["GX010042.MP4", "GX020042.MP4", "GX010043.MP4"])
    assert [(r.kind, len(r.parts)) for r in found] == [("chapters", 2), ("video", 1)]


def test_results_litter_and_other_files_are_no_recordings(tmp_path):
    for path in ("a/cam1.mp4", "results/x.png", "._cam1.mp4", "notes.txt", ".snakemake/y.png", "a/cam1.srt"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_bytes(b"x")
    assert [r.path for r in recordings_in(str(tmp_path))] == [os.path.join("a", "cam1.mp4")]


def test_a_link_and_its_file_are_one_recording_the_one_in_its_place(tmp_path):
    (tmp_path / "runs/a").mkdir(parents=True)
    (tmp_path / "x_cam1.mp4").write_bytes(b"x")
    (tmp_path / "runs/a/cam1.mp4").symlink_to("../../x_cam1.mp4")
    assert [r.path for r in recordings_in(str(tmp_path))] == [os.path.join("runs", "a", "cam1.mp4")]

import os

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.beside import alike_but_for_case, broken_link, entries, is_recording, may_be_recording, table_in


def test_litter_is_no_part_of_a_folder(tmp_path):
    for name in ("cam1.mov", "Thumbs.db", ".DS_Store", "._cam1.mov", "desktop.ini", "~$points.xlsx", "cam1.mov~"):
        (tmp_path / name).write_text("x")
    (tmp_path / "__MACOSX").mkdir()
    assert entries(str(tmp_path)) == ["cam1.mov"]


@pytest.mark.parametrize("name", ["cam1.SRT", "cam1.THM", "cam1.LRV", "cam1.xml", "cam1.cih", "notes", "cam1.wav"])
def test_what_cameras_write_beside_a_recording_is_none(name):
    assert not may_be_recording(name)


def test_an_ending_that_is_not_known_may_be_that_of_a_recording():
    assert may_be_recording("cam1.r3d")
    assert not is_recording("cam1.r3d")
    assert is_recording("cam1.MOV")


def test_a_link_that_leads_nowhere_is_named_with_its_target(tmp_path):
    link = tmp_path / "cam1.mov"
    link.symlink_to("/disk/that/is/off.mov")
    assert "cam1.mov: a link to '/disk/that/is/off.mov', which is not there" in (broken_link(str(link)) or "")
    assert broken_link(str(tmp_path / "nothing")) is None


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_folder_that_may_not_be_read_is_one_line(tmp_path):
    (tmp_path / "a").mkdir(mode=0)
    with pytest.raises(VidtrackError, match="cannot be read"):
        entries(str(tmp_path / "a"))


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("points.xlsx", "points.xlsx: a spreadsheet, and only points.csv is read"),
        ("Points.csv", "Points.csv: only points.csv is read. Rename"),
        ("points.csv.txt", "points.csv.txt: only points.csv is read"),
        ("point.csv", "point.csv: only points.csv is read"),
        ("points.CSV", "points.CSV: only points.csv is read"),
    ],
)
def test_a_table_that_is_not_named_as_it_should_be_is_a_problem(tmp_path, name, says):
    (tmp_path / name).write_text("x")
    problems: list[str] = []
    assert table_in(str(tmp_path), "points.csv", problems) is None
    assert len(problems) == 1
    assert says in problems[0]


def test_other_files_are_no_tables(tmp_path):
    (tmp_path / "notes.csv").write_text("x")
    problems: list[str] = []
    assert table_in(str(tmp_path), "points.csv", problems) is None
    assert problems == []


def test_names_that_differ_in_capitals_alone_are_told():
    assert alike_but_for_case(["a", "B", "b"], "runs") == [
        "runs: B and b differ in capitals alone. Rename one of them."
    ]

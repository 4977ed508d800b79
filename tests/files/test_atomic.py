"""A file appears whole or not at all, and what killed writers leave can be cleared away."""

import os
import threading

import pytest

from vidtrack.files.atomic import PARTIAL, remove_all_partial, remove_partial, replacing


def test_a_file_that_fails_half_way_leaves_the_old_one_and_nothing_else(tmp_path):
    path = tmp_path / "out"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as file:
        file.write(b"half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out"]


def test_folders_are_made_and_permissions_are_those_of_any_new_file(tmp_path):
    with replacing(tmp_path / "a" / "b") as file:
        file.write(b"x")
    (tmp_path / "plain").write_text("x")
    assert (tmp_path / "a" / "b").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_reader_meets_the_old_file_or_the_new_one_while_writers_take_turns(tmp_path):
    path = tmp_path / "out"
    path.write_bytes(b"a" * 4096)

    def write(letter):
        for _ in range(20):
            with replacing(path) as file:
                for _ in range(4):
                    file.write(letter * 1024)
                    file.flush()

    writers = [threading.Thread(target=write, args=(letter,)) for letter in (b"a", b"b")]
    for writer in writers:
        writer.start()
    while any(writer.is_alive() for writer in writers):
        assert set(path.read_bytes()) in ({ord("a")}, {ord("b")})
        assert path.stat().st_size == 4096
    assert os.listdir(tmp_path) == ["out"]


def test_what_killed_writers_of_this_file_left_is_removed_and_nothing_else(tmp_path):
    kept = ["out", "other", f".out.json.abc{PARTIAL}", f".outer.abc{PARTIAL}", f"out.abc{PARTIAL}", ".out.abc"]
    for name in [*kept, f".out.abc12_x{PARTIAL}", f".out.zzz{PARTIAL}"]:
        (tmp_path / name).write_text("x")
    remove_partial(tmp_path / "out")
    assert sorted(os.listdir(tmp_path)) == sorted(kept)
    remove_partial(tmp_path / "nowhere" / "out")


def test_the_name_of_an_unfinished_file_is_one_that_the_clearing_knows_however_long(tmp_path):
    path = tmp_path / ("n" * 240)
    with replacing(path) as file:
        file.write(b"x")
        unfinished = [name for name in os.listdir(tmp_path) if name.endswith(PARTIAL)]
        assert len(unfinished) == 1
        remove_partial(path)
        assert not os.listdir(tmp_path)
        (tmp_path / unfinished[0]).write_text("put back")
    assert os.listdir(tmp_path) == [path.name]


def test_a_writer_that_is_interrupted_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "out"):
        raise KeyboardInterrupt
    assert os.listdir(tmp_path) == []


def test_all_that_killed_writers_left_in_a_folder_is_removed_and_nothing_else(tmp_path):
    (tmp_path / "runs/a").mkdir(parents=True)
    left = [tmp_path / ".report.html.ab_12.partial", tmp_path / "runs/a/.out.parquet.x.y.partial"]
    kept = [tmp_path / "runs/a/cam1.partial", tmp_path / ".hidden", tmp_path / "runs/a/out.parquet"]
    for path in (*left, *kept):
        path.write_text("x")
    remove_all_partial(str(tmp_path))
    assert [path.exists() for path in (*left, *kept)] == [False] * 2 + [True] * 3
    remove_all_partial(str(tmp_path / "nowhere"))

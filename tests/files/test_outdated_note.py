"""The note beside results of an earlier call."""

from vidtrack.files.outdated_note import NAME, is_outdated, write_note


def test_the_note_lists_files_of_its_folder_and_of_those_below(tmp_path):
    run = tmp_path / "results/runs/pluck"
    run.mkdir(parents=True)
    write_note(str(run), ["runs/pluck/trajectories.csv", "runs/pluck/centroids/cam1.parquet"])
    assert "of an earlier call" in (run / NAME).read_text()
    assert is_outdated(str(run / "trajectories.csv"))
    assert is_outdated(str(run / "centroids/cam1.parquet"))
    assert not is_outdated(str(run / "trajectories.parquet"))
    assert not is_outdated(str(tmp_path / "results/runs/still/trajectories.csv"))


def test_a_relative_path_without_a_note_is_not_outdated(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert not is_outdated("trajectories.csv")

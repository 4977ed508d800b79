from tests.exchange.thesis.folder import write_old
from vidtrack.command import main


def test_an_old_folder_becomes_an_experiment(tmp_path, capsys):
    (tmp_path / "old").mkdir()
    write_old(tmp_path / "old")
    assert main(["import", str(tmp_path / "old"), str(tmp_path / "lab"), "--units", "in", "--run", "P12-B"]) == 0
    made = sorted(str(path.relative_to(tmp_path / "lab")) for path in (tmp_path / "lab").rglob("*") if path.is_file())
    assert made == [
        "calibration/balls/cam1.prn",
        "calibration/balls/cam2.prn",
        "calibration/points.csv",
        "config.yaml",
        "runs/P12-B/cam1.prn",
        "runs/P12-B/cam2.prn",
    ]
    assert "to do: vidtrack run" in capsys.readouterr().out
    assert main(["import", str(tmp_path / "old"), str(tmp_path / "lab"), "--units", "in"]) == 1
    assert "is there already" in capsys.readouterr().err


def test_the_unit_is_asked_for(tmp_path, capsys):
    (tmp_path / "old").mkdir()
    assert main(["import", str(tmp_path / "old"), str(tmp_path / "lab")]) == 1
    assert "--units" in capsys.readouterr().err
    assert main(["import", str(tmp_path / "old"), str(tmp_path / "lab"), "--units", "in"]) == 1
    assert "no camparm.dat" in capsys.readouterr().err

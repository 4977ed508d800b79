import pytest

from tests.exchange.thesis.rig import points
from vidtrack.errors import VidtrackError
from vidtrack.files.records import read_json, read_png
from vidtrack.files.tables import read_parquet
from vidtrack.jobs.import_points import run
from vidtrack.workflow.job import Job


def job(tmp_path, **tracks) -> Job:
    p = points(4)
    (tmp_path / "points.csv").write_text("tag,x,y,z\n" + "".join(f"{k},{x},{y},{z}\n" for k, (x, y, z) in enumerate(p)))
    (tmp_path / "cam1.csv").write_text("tag,Xf,Yf\n0,10,20\n2,30,40\n")
    names = {"sightings": "s.parquet", "picture": "p.png", "background": "b.png", "record": "r.json"}
    order = {"units": "in", "camera": "cam1", "sigma": 0.1, "tracks": tracks}
    order["clips"] = {"row1": {"tags": ["0", "1", "2", "3"], "sd": None}}
    inputs = {"points": str(tmp_path / "points.csv"), "files": [str(tmp_path / "cam1.csv")]}
    return Job(order, inputs, {name: str(tmp_path / path) for name, path in names.items()})


def test_digitised_points_become_sightings(tmp_path):
    own = job(tmp_path, size=[640, 480])
    run(own)
    table = read_parquet(own.outputs["sightings"])
    assert table["found"].tolist() == [True, False, True, False]
    assert read_png(own.outputs["picture"]).shape[:2] == (480, 640)
    record = read_json(own.outputs["record"])
    assert (record["points"], record["found"]) == (4, 2)
    assert record["pictures"]["row1"]["width"] == 640


def test_the_size_of_the_picture_is_asked_for_by_its_key(tmp_path):
    with pytest.raises(VidtrackError, match=r"config.yaml: cameras\.cam1\.tracks\.size"):
        run(job(tmp_path))

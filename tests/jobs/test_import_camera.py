import numpy as np

from tests.exchange.cameras.rig import SIZE, points, seen
from tests.exchange.cameras.test_anipose import toml
from vidtrack.files.camera_json import read_camera
from vidtrack.files.records import read_json
from vidtrack.files.tables import read_parquet
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.jobs.import_camera import run
from vidtrack.workflow.job import Job


def job(tmp_path, **settings) -> Job:
    (tmp_path / "cam1.toml").write_text(toml())
    outputs = {"camera": str(tmp_path / "camera.json"), "points": str(tmp_path / "points.parquet")}
    outputs |= {"labelling": str(tmp_path / "labelling.json")}
    return Job({"camera": "cam1", "units": "m"} | settings, {"file": str(tmp_path / "cam1.toml")}, outputs)


def test_a_camera_of_another_program_becomes_camera_json(tmp_path):
    own = job(tmp_path, sigma_px=0.2)
    run(own)
    found = read_camera(own.outputs["camera"])
    np.testing.assert_allclose(project(found.camera, points()), seen(), atol=0.05)
    assert found.camera.image_size == SIZE
    assert found.uncertainty.names == ("Cx", "Cy")
    assert found.uncertainty.standard_errors.tolist() == [0.2, 0.2]
    assert found.record["findings"] == []
    assert len(read_parquet(own.outputs["points"])) == 0


def test_what_is_not_known_of_a_camera_makes_sigma_unknown_and_never_small(tmp_path):
    own = job(tmp_path)
    run(own)
    found = read_camera(own.outputs["camera"])
    assert np.isnan(found.uncertainty.covariance).any()
    assert [each["code"] for each in read_json(own.outputs["camera"])["findings"]] == ["camera-sigma-unknown"]
    other = found.camera.with_(T=found.camera.T + np.array([1.0, 0, 0]))
    b = np.stack([project(camera, points()[None]) for camera in (found.camera, other)])
    located = locate_points([found.camera, other], b, sd=np.full(b.shape, 0.1), uncertainties=[found.uncertainty] * 2)
    np.testing.assert_allclose(located.point[0], points(), atol=1e-6)
    assert np.isnan(located.sigma).all()

import numpy as np

from tests.geometry.underwater import LEFT
from vidtrack.geometry.camera import project
from vidtrack.geometry.interface import planes_of
from vidtrack.geometry.light import along_path
from vidtrack.geometry.refraction import crossed


def test_a_path_is_followed_through_all_media():
    b = project(LEFT, [50.0, 30, 20])
    path = along_path(LEFT, b, np.linspace(10, 2500, 40))
    planes = planes_of(LEFT.through, LEFT.position)
    assert set(crossed(planes, path.T)) == {0, 1, 2}
    np.testing.assert_allclose(project(LEFT, path), np.broadcast_to(b, (40, 2)), atol=1e-7)
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).max() <= 2490 / 39 + 1e-9

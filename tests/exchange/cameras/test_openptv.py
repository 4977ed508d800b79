import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.exchange.cameras.rig import said
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.geometry.camera import project

SIZE, PIXEL = (1280, 1024), 0.012
X0, CC, XH, YH = np.array([105.0, -30.0, 400.0]), 60.0, 0.4, -0.25
DM = Rotation.from_euler("xyz", [0.08, 0.25, -0.04]).as_matrix()
ADDPAR = (3e-5, -2e-8, 0.0, 4e-6, -5e-6, 1.002, 0.0015)


def files(folder, glass=(0.0, 0.0, 0.0), addpar=ADDPAR):
    rows = [X0, [0.08, 0.25, -0.04], *DM, [XH, YH], [CC], glass]
    (folder / "cam1.ori").write_text("\n".join(" ".join(f"{v:.10f}" for v in row) for row in rows) + "\n")
    (folder / "cam1.addpar").write_text(" ".join(f"{v:.12g}" for v in addpar))
    return folder / "cam1.ori"


def seen(p):
    """liboptv's flat_image_coord, flat_to_dist and metric_to_pixel, less half a pixel; one medium."""
    c = (p - X0) @ DM
    x, y = -CC * c[:, 0] / c[:, 2] + XH, -CC * c[:, 1] / c[:, 2] + YH
    k1, k2, k3, p1, p2, scx, she = ADDPAR
    r2 = x * x + y * y
    radial = k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x + x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y
    yd = y + y * radial + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y
    x, y = scx * xd - np.sin(she) * yd, np.cos(she) * yd
    return np.stack([x / PIXEL + SIZE[0] / 2, SIZE[1] / 2 - y / PIXEL], -1) - 0.5


def points():
    c = (
        np.random.default_rng(0).uniform([-0.11, -0.09, -1], [0.11, 0.09, -1], (60, 3))
        * np.linspace(350, 450, 60)[:, None]
    )
    return c @ DM.T + X0


SENSOR = (SIZE[0] * PIXEL, SIZE[1] * PIXEL)


def test_the_camera_sees_points_where_openptv_says(tmp_path):
    given = read_camera(files(tmp_path), said(world="mm", size=SIZE, sensor=SENSOR))
    b = seen(points())
    assert ((b > 0) & (b < SIZE)).all()
    assert given.largest_px < 0.02
    np.testing.assert_allclose(project(given.camera, points()), b, atol=given.largest_px + 1e-4)
    assert given.unit == "mm"
    assert given.findings == ()


def test_glass_that_is_not_applied_is_reported(tmp_path):
    given = read_camera(files(tmp_path, (0.0, 0.0, 80.0)), said(world="mm", size=SIZE, sensor=SENSOR))
    assert [finding.code for finding in given.findings] == ["glass-not-applied"]


@pytest.mark.parametrize(("more", "key"), [({"sensor": SENSOR}, r"camera_file\.size"), ({"size": SIZE}, "sensor")])
def test_what_the_files_do_not_say_is_asked_for_by_its_key(tmp_path, more, key):
    with pytest.raises(VidtrackError, match=rf"config.yaml: cameras\.cam1\.{key}"):
        read_camera(files(tmp_path), said(world="mm", **more))


def test_a_pose_without_its_lens_is_refused(tmp_path):
    path = files(tmp_path)
    (tmp_path / "cam1.addpar").unlink()
    with pytest.raises(VidtrackError, match=r"cam1\.addpar: no such file"):
        read_camera(path, said(world="mm", size=SIZE, sensor=SENSOR))


def test_a_file_that_breaks_off_is_refused(tmp_path):
    path = files(tmp_path)
    path.write_text(path.read_text()[:120])
    with pytest.raises(VidtrackError, match="Copy the whole file again"):
        read_camera(path, said(world="mm", size=SIZE, sensor=SENSOR))

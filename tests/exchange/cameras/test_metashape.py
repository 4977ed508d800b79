import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.exchange.cameras.rig import SIZE, said
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import in_world
from vidtrack.geometry.camera import project

F, CX, CY, K1, K2, K3, P1, P2, B1, B2 = 1100.0, 12.5, -8.25, -0.08, 0.02, -0.003, 3e-4, -5e-4, 4.0, -1.5
CAMERA = np.eye(4)
CAMERA[:3, :3] = Rotation.from_rotvec([0.2, -0.4, 0.1]).as_matrix()
CAMERA[:3, 3] = [0.3, -0.2, -1.1]
TURN, SCALE, SHIFT = Rotation.from_rotvec([1.0, 0.3, -0.5]).as_matrix(), 4.5, np.array([10.0, 20.0, 5.0])


def xml(transform=True, adjusted="adjusted") -> str:
    def numbers(values):
        return " ".join(repr(float(v)) for v in np.ravel(values))

    chunk = (
        f"<transform><rotation locked='0'>{numbers(TURN)}</rotation><translation>{numbers(SHIFT)}</translation>"
        f"<scale>{SCALE}</scale></transform>"
    )
    lens = f"<f>{F}</f><cx>{CX}</cx><cy>{CY}</cy><k1>{K1}</k1><k2>{K2}</k2><k3>{K3}</k3><p1>{P1}</p1><p2>{P2}</p2>"
    lens += f"<b1>{B1}</b1><b2>{B2}</b2>"
    size = f"<resolution width='{SIZE[0]}' height='{SIZE[1]}'/>"
    return (
        "<?xml version='1.0'?><document version='1.5.0'><chunk label='Chunk 1'><sensors next_id='1'><sensor id='0'>"
        f"{size}<calibration type='frame' class='initial'>{size}<f>900</f></calibration>"
        f"<calibration type='frame' class='{adjusted}'>{size}{lens}</calibration></sensor></sensors><cameras>"
        f"<camera id='0' sensor_id='0' label='cam1.jpg'><transform>{numbers(CAMERA)}</transform></camera>"
        f"<camera id='1' sensor_id='0' label='cam2.jpg'/></cameras>{chunk if transform else ''}</chunk></document>"
    )


def seen(p, scale=SCALE, turn=TURN, shift=SHIFT):
    """Metashape's own equations (manual, appendix D), from the world to its pixels, less half a pixel."""
    inside = (p - shift) @ turn / scale
    c = (inside - CAMERA[:3, 3]) @ CAMERA[:3, :3]
    x, y = c[:, 0] / c[:, 2], c[:, 1] / c[:, 2]
    r2 = x * x + y * y
    radial = 1 + K1 * r2 + K2 * r2**2 + K3 * r2**3
    xd = x * radial + P1 * (r2 + 2 * x * x) + 2 * P2 * x * y
    yd = y * radial + P2 * (r2 + 2 * y * y) + 2 * P1 * x * y
    u = SIZE[0] / 2 + CX + xd * F + xd * B1 + yd * B2
    v = SIZE[1] / 2 + CY + yd * F
    return np.stack([u, v], -1) - 0.5


def points(scale=SCALE, turn=TURN, shift=SHIFT):
    c = np.random.default_rng(0).uniform([-0.5, -0.4, 1], [0.5, 0.4, 1], (50, 3)) * np.linspace(2, 4, 50)[:, None]
    inside = c @ CAMERA[:3, :3].T + CAMERA[:3, 3]
    return scale * inside @ turn.T + shift


def test_the_camera_sees_points_where_metashape_says(tmp_path):
    (tmp_path / "cam1.xml").write_text(xml())
    given = read_camera(tmp_path / "cam1.xml", said(world="mm"))
    camera = in_world(given, said(world="mm"))
    assert given.largest_px < 0.03
    np.testing.assert_allclose(project(camera, 1000 * points()), seen(points()), atol=given.largest_px + 1e-6)
    assert given.findings == ()


def test_without_a_transform_of_the_chunk_the_unit_is_asked_for(tmp_path):
    (tmp_path / "cam1.xml").write_text(xml(transform=False))
    with pytest.raises(VidtrackError, match=r"cameras\.cam1\.camera_file\.units"):
        read_camera(tmp_path / "cam1.xml", said())
    given = read_camera(tmp_path / "cam1.xml", said(units="m"))
    own = {"scale": 1.0, "turn": np.eye(3), "shift": np.zeros(3)}
    np.testing.assert_allclose(project(given.camera, points(**own)), seen(points(**own), **own), atol=0.03)


def test_an_initial_calibration_alone_is_reported(tmp_path):
    (tmp_path / "cam1.xml").write_text(xml(adjusted="initial"))
    assert "lens-not-adjusted" in [finding.code for finding in read_camera(tmp_path / "cam1.xml", said()).findings]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (xml()[:-40], "cut off or damaged"),
        ("<document/>", "no chunk"),
        (xml().replace("<transform>0.9", "<transform>"), "not 16 numbers|rotation"),
        (xml().replace("<k1>", "<p3>0.1</p3><k1>"), "p3 or p4"),
    ],
)
def test_a_file_that_is_not_whole_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "cam1.xml").write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_camera(tmp_path / "cam1.xml", said())
    assert "\n" not in str(error.value)


def test_a_camera_that_was_not_aligned_is_not_there(tmp_path):
    (tmp_path / "x.xml").write_text(xml())
    with pytest.raises(VidtrackError, match=r"cameras\.cam2\.camera_file\.camera"):
        read_camera(tmp_path / "x.xml", said(name="cam2", camera="cam2"))

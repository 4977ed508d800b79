"""A known lens in whatever file it came: the same pixels as the program that wrote it, and clear lines where not."""

import json

import cv2
import numpy as np
import pytest

from tests.geometry.test_brown import MILD, SIZE, by_opencv, seen_by
from vidtrack.calibration.camera.refine import Uncertainty
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said
from vidtrack.exchange.lens import known_lens
from vidtrack.files.camera_json import write_camera
from vidtrack.geometry.camera import project
from vidtrack.geometry.lens_conversion import camera_from_brown

LENS = MILD
K = np.array([[LENS.fx, 0, LENS.cx], [0, LENS.fy, LENS.cy], [0, 0, 1.0]])
D = np.array([LENS.k[0], LENS.k[1], LENS.p1, LENS.p2, LENS.k[2]])
POINTS = seen_by(LENS)


def written(path, text):
    path.write_text(text)
    return str(path)


def given(**own):
    return own


def same(lens, tolerance=0.05):
    """Whether the lens sees as OpenCV does with the matrix and coefficients above, turns of the camera apart."""
    reference = camera_from_brown(LENS).camera
    assert lens.largest_px < tolerance
    return (
        np.abs(project(lens.camera.with_(R=reference.R, T=np.zeros(3)), POINTS) - by_opencv(LENS, POINTS)).max() < 0.06
    )


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_what_opencv_writes_is_read(tmp_path, ending):
    """OpenCV's own FileStorage is the outside source; of JSON only its plain matrices as lists."""
    path = tmp_path / f"lens.{ending}"
    if ending == "json":
        path.write_text(json.dumps({"camera_matrix": K.tolist(), "dist_coeffs": [D.tolist()], "image_size": SIZE}))
    else:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", SIZE[0])
        storage.write("image_height", SIZE[1])
        storage.write("camera_matrix", K)
        storage.write("distortion_coefficients", D)
        storage.release()
    lens = known_lens(given(), str(path), "cam1", SIZE)
    assert same(lens)
    assert lens.names == ()


def test_a_camera_info_of_ros_is_read(tmp_path):
    text = f"""image_width: {SIZE[0]}
image_height: {SIZE[1]}
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: {K.ravel().tolist()}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: {D.tolist()}}}
"""
    assert same(known_lens(given(), written(tmp_path / "head.yaml", text), "cam1", SIZE))


def test_metashape_counts_from_the_middle_and_exchanges_the_tangential_terms(tmp_path):
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<calibration><projection>frame</projection><width>{SIZE[0]}</width><height>{SIZE[1]}</height>
<f>{LENS.fy}</f><b1>{LENS.fx - LENS.fy}</b1><cx>{LENS.cx - (SIZE[0] - 1) / 2}</cx><cy>{LENS.cy - (SIZE[1] - 1) / 2}</cy>
<k1>{LENS.k[0]}</k1><k2>{LENS.k[1]}</k2><k3>{LENS.k[2]}</k3><p1>{LENS.p2}</p1><p2>{LENS.p1}</p2></calibration>"""
    assert same(known_lens(given(), written(tmp_path / "sensor.xml", text), "cam1", SIZE))


def test_of_several_sensors_of_metashape_the_named_one_is_taken(tmp_path):
    one = '<sensor id="{0}" label="{0}"><calibration type="frame" class="{2}"><resolution width="1280" height="720"/>'
    one += "<f>{1}</f><cx>0</cx><cy>0</cy></calibration></sensor>"
    text = "<document><chunk><sensors>" + one.format("cam1", 900, "adjusted") + one.format("cam2", 1100, "initial")
    path = written(tmp_path / "cameras.xml", text + "</sensors></chunk></document>")
    assert known_lens(given(), path, "cam2", SIZE).camera.f == pytest.approx(1100)
    assert known_lens(given(camera="cam1"), path, "cam2", SIZE).camera.f == pytest.approx(900)
    with pytest.raises(VidtrackError, match=r"cam1, cam2.*say which"):
        known_lens(given(), path, "cam3", SIZE)


def test_colmap_counts_from_the_corner_of_the_first_pixel(tmp_path):
    text = f"# cameras\n1 OPENCV 1280 720 {LENS.fx} {LENS.fy} {LENS.cx + 0.5} {LENS.cy + 0.5} " + " ".join(
        map(str, (LENS.k[0], LENS.k[1], LENS.p1, LENS.p2))
    )
    lens = known_lens(given(), written(tmp_path / "cameras.txt", text), "cam1", SIZE)
    expected = camera_from_brown(LENS._replace(k=LENS.k[:2])).camera
    np.testing.assert_allclose(project(lens.camera, POINTS), project(expected, POINTS), atol=1e-9)


def test_a_model_that_has_no_counterpart_is_named(tmp_path):
    path = written(tmp_path / "cameras.txt", "1 FOV 1280 720 900 900 640 360 0.9\n")
    with pytest.raises(VidtrackError, match=r"cameras\.txt.*FOV"):
        known_lens(given(), path, "cam1", SIZE)


def test_a_camera_json_is_its_lens_and_its_covariance_is_a_prior(tmp_path):
    camera = camera_from_brown(LENS).camera
    C = np.diag([1e-4] * 6 + [4.0, 1.0])
    known = Uncertainty(("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z", "f", "Cx"), np.zeros(3), C)
    write_camera(tmp_path / "camera.json", camera, known, {"model": "brown"}, {})
    lens = known_lens(given(), str(tmp_path / "camera.json"), "cam1", SIZE)
    assert (lens.names, lens.largest_px) == (("f", "Cx"), 0.0)
    np.testing.assert_allclose(lens.covariance, np.diag([4.0, 1.0]))
    assert known_lens(given(use="fixed"), str(tmp_path / "camera.json"), "cam1", SIZE).names == ()


def test_numbers_in_the_config_are_a_lens_and_their_deviations_a_prior():
    lens = known_lens(given(fx=1400.0, k1=-0.1, sd={"fx": 2.0, "fy": 2.0}), None, "cam1", SIZE)
    assert lens.camera.Cx == pytest.approx(639.5)
    assert "f" in lens.names
    assert np.sqrt(lens.covariance[lens.names.index("f"), lens.names.index("f")]) == pytest.approx(2.0, rel=0.01)


def test_numbers_take_the_place_of_the_file_s(tmp_path):
    path = written(tmp_path / "lens.json", json.dumps({"K": K.tolist(), "dist": [0.0] * 5}))
    lens = known_lens(given(fx=1500.0, fy=1500.0), path, "cam1", SIZE)
    assert lens.camera.f == pytest.approx(1500)
    assert lens.camera.Cx == pytest.approx(LENS.cx)


def test_a_lens_of_larger_pictures_is_scaled_and_one_of_another_shape_refused(tmp_path):
    path = written(tmp_path / "lens.json", json.dumps({"K": K.tolist(), "dist": D.tolist(), "image_size": SIZE}))
    half = known_lens(given(), path, "cam1", (640, 360)).camera
    whole = known_lens(given(), path, "cam1", SIZE).camera
    np.testing.assert_allclose(2 * (project(half, POINTS) + 0.5) - 0.5, project(whole, POINTS), atol=0.05)
    with pytest.raises(VidtrackError, match=r"1280 x 720 px, the clips have 640 x 480"):
        known_lens(given(), path, "cam1", (640, 480))


WHOLE_OPENCV = {"image_width": SIZE[0], "image_height": SIZE[1], "camera_matrix": K, "distortion_coefficients": D}
WHOLE_OPENCV |= {"fisheye_model": 0, "rvec": np.array([0.1, -0.2, 0.3]), "tvec": np.array([0.1, 0.2, 3.0])}
WHOLE_METASHAPE = f"""<document><chunk><sensors><sensor id="0" label="one"><resolution width="{SIZE[0]}"
height="{SIZE[1]}"/><calibration type="frame" class="adjusted"><f>900</f><cx>3</cx><cy>-2</cy><k1>-0.1</k1><p1>1e-3</p1>
<b2>0.5</b2></calibration></sensor></sensors><cameras><camera id="0" sensor_id="0" label="cam1"><transform>
{" ".join(map(str, np.eye(4).ravel()))}</transform></camera></cameras></chunk></document>"""


def opencv_file(path, **values):
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        storage.write(name, value)
    storage.release()
    return str(path)


@pytest.mark.parametrize("name", ["opencv.yml", "opencv.xml", "metashape.xml"])
def test_the_lens_of_a_file_is_that_of_its_whole_camera(tmp_path, name):
    path = str(tmp_path / name)
    if name.startswith("opencv"):
        opencv_file(path, **WHOLE_OPENCV)
    else:
        written(tmp_path / name, WHOLE_METASHAPE)
    lens = known_lens(given(), path, "cam1", SIZE).camera
    whole = read_camera(path, Said("cam1", "m", units="m")).camera
    at = {"R": np.eye(3), "T": np.zeros(3)}
    np.testing.assert_array_equal(project(lens.with_(**at), POINTS), project(whole.with_(**at), POINTS))


def test_what_no_term_here_describes_is_refused_of_a_lens_and_of_a_camera(tmp_path):
    """A tilted sensor, and Metashape's p3: left out, they would shift every position without a word."""
    tilted = WHOLE_OPENCV | {"distortion_coefficients": np.array([*D, *[0.0] * 7, 0.01, 0.02])}
    cases = [
        (opencv_file(tmp_path / "tilted.yml", **tilted), "tilted sensor"),
        (written(tmp_path / "p3.xml", WHOLE_METASHAPE.replace("<b2>", "<p3>0.1</p3><b2>")), "p3 or p4"),
    ]
    for path, what in cases:
        with pytest.raises(VidtrackError, match=what):
            known_lens(given(), path, "cam1", SIZE)
        with pytest.raises(VidtrackError, match=what):
            read_camera(path, Said("cam1", "m", units="m"))


def test_the_first_camera_of_a_stereo_pair_is_a_lens_and_no_camera_with_a_pose(tmp_path):
    """R and T of OpenCV's stereo sample lead from one camera to the other."""
    path = opencv_file(tmp_path / "pair.yml", M1=K, D1=D, R=np.eye(3), T=np.array([0.2, 0.0, 0.0]))
    assert same(known_lens(given(), path, "cam1", SIZE))
    with pytest.raises(VidtrackError, match="no camera_matrix"):
        read_camera(path, Said("cam1", "m", size=SIZE))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("lens.json", "{}"),
        ("lens.json", '{"camera_matrix": "a b c"}'),
        ("lens.json", '{"camera_matrix": null}'),
        ("lens.xml", "<calibration><f>many</f><width>9</width><height>9</height></calibration>"),
        ("lens.json", '{"camera_matrix": [[1, 2], [3, 4]]}'),
        ("lens.json", "not json"),
        ("lens.json", "[" * 20_000),
        ("lens.json", '{"a":' * 20_000),
        ("lens.yml", "%YAML:1.0\n---\ncamera_matrix: [a, b"),
        ("lens.xml", "<!DOCTYPE x [<!ENTITY a 'b'>]><calibration/>"),
        ("lens.xml", "<calibration><f>900</f></calibration>"),
        ("lens.xml", "<calibration>"),
        ("lens.yml", "camera_matrix: {rows: 3, cols: 3, data: [.nan, 0, 1, 0, 1, 1, 0, 0, 1]}"),
        ("cameras.txt", ""),
        ("cameras.txt", "1 OPENCV 1280 720 900\n"),
    ],
)
def test_what_holds_no_lens_is_one_clear_line(tmp_path, name, text):
    path = written(tmp_path / name, text)
    with pytest.raises(VidtrackError) as caught:
        known_lens(given(), path, "cam1", SIZE)
    (line,) = caught.value.problems
    assert line.startswith(path)
    assert "\n" not in line


def test_a_prior_without_a_covariance_is_refused(tmp_path):
    path = written(tmp_path / "lens.json", json.dumps({"K": K.tolist(), "dist": D.tolist()}))
    with pytest.raises(VidtrackError, match="no covariance"):
        known_lens(given(use="prior"), path, "cam1", SIZE)

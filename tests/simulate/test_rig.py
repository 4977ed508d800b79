"""The thesis's rig as figures and text give it."""

import numpy as np
import pytest

from vidtrack.geometry.camera import camera_from_world, contains, line_of_sight, project
from vidtrack.geometry.jacobian import derivatives
from vidtrack.simulate.rig import (
    focal_length_from_field,
    look_at,
    points_on_wires,
    position_from_angles,
    thesis_points,
    thesis_rig,
)


def test_a_camera_looks_where_it_is_told():
    position, target = np.array([3.0, -4.0, 10.0]), np.array([1.0, 2.0, -1.0])
    R = look_at(position, target, roll_deg=20)
    along = R @ (target - position)
    assert along == pytest.approx([0, 0, np.linalg.norm(target - position)])
    assert R @ R.T == pytest.approx(np.eye(3))
    assert np.linalg.det(R) == pytest.approx(1)


def test_without_roll_the_horizon_is_level_and_up_is_up():
    R = look_at([-10, 0, 0], [0, 0, 0])
    assert R[0] == pytest.approx([0, -1, 0])  # looking along +x, -y lies to the right
    assert R[1] == pytest.approx([0, 0, -1])  # y down


def test_a_camera_rolled_clockwise_sees_the_horizon_turn_the_other_way():
    R = look_at([-10, 0, 0], [0, 0, 0], roll_deg=90)
    assert R[0] == pytest.approx([0, 0, -1])  # its right side now points down


@pytest.mark.parametrize(("position", "target"), [((1, 2, 3), (1, 2, 3)), ((0, 0, 5), (0, 0, 0))])
def test_an_attitude_that_is_not_determined_is_refused(position, target):
    with pytest.raises(ValueError, match="camera"):
        look_at(position, target)


def test_pan_and_tilt_of_45_degrees_stand_the_camera_above_and_beside():
    position = position_from_angles([0, 0, 0], pan_deg=45, tilt_deg=45, distance=2)
    assert position == pytest.approx([-1, -1, np.sqrt(2)])


def test_a_lens_of_11_mm_sees_128_inches_at_160_with_a_sensor_of_8_8_mm():
    assert focal_length_from_field(width=128, distance=160, sensor_width=8.8) == pytest.approx(11)


def test_the_thesis_rig_sees_about_128_inches_across_and_160_along_the_diagonal():
    for camera in thesis_rig(4):
        width, height = camera.image_size
        centre, sight = line_of_sight(camera, [[0, camera.Cy], [width - 1, camera.Cy], [0, 0], [width - 1, height - 1]])
        forward = camera.R[2]
        edge = centre + sight * (-centre @ forward / (sight @ forward))[:, None]
        assert np.linalg.norm(edge[1] - edge[0]) == pytest.approx(128, abs=2)
        assert np.linalg.norm(edge[3] - edge[2]) == pytest.approx(160, abs=3)


def test_no_camera_of_the_thesis_rig_is_the_textbook_one():
    for camera in thesis_rig(4):
        assert abs(camera.Sx - 1) > 0.01
        off = np.hypot(camera.Cx - 255.5, camera.Cy - 239.5)
        assert 5 < off < 15
        corner = np.array([[0.0, 0.0], [511.0, 479.0]])
        straight = camera.with_(kappa1=0.0)
        centre, sight = line_of_sight(camera, corner)
        moved = project(straight, centre + 100 * sight) - corner
        assert (np.hypot(*moved.T) > 4).all()
        assert (np.hypot(*moved.T) < 10).all()


def test_the_target_hangs_amid_the_balls_as_section_6_8_says():
    tags, places = thesis_points()
    assert tags == [str(n) for n in range(1, 65)]
    assert len(np.unique(places, axis=0)) == 64
    assert np.abs(places[:, 2]).min() == 3  # three inches from the balls above and below
    assert np.abs(places[:, 1]).min() == 2  # two from the rows beside it
    assert np.abs(places[:, 0]).max() > 24  # and the pluck stays among them
    assert len(np.unique(places[:16, 1])) == 1  # a row lies along the rod


def test_every_camera_sees_every_ball_whole():
    _, places = thesis_points()
    for camera in thesis_rig(4):
        assert contains(camera, project(camera, places), margin=10).all()
        assert (camera_from_world(camera, places)[:, 2] > 0).all()


def test_a_pixel_of_noise_costs_the_third_of_an_inch_that_was_measured_before():
    """The perfect-camera floor of notes/calibration: 0.366 in of mean 3-D error for each px, two cameras."""
    rng = np.random.default_rng(5)
    _, places = thesis_points()
    p = rng.uniform(-1, 1, (400, 3)) * places.max(0)
    by_point = [derivatives(camera, p, np.zeros(3)).by_point for camera in thesis_rig()]
    covariance = np.linalg.inv(sum(np.einsum("nij,nik->njk", d, d) for d in by_point))
    error = np.einsum("nij,njk->nik", np.linalg.cholesky(covariance), rng.normal(size=(400, 3, 200)))
    assert np.linalg.norm(error, axis=1).mean() == pytest.approx(0.366, rel=0.03)


def test_points_on_wires_are_tagged_row_by_row_from_the_top_down():
    tags, places = points_on_wires(rows=1, wires=2, balls=2, spacing=(10, 1, 6), centre=(0, 0, 100))
    assert tags == ["1", "2", "3", "4"]
    assert places.tolist() == [[-5, 0, 103], [-5, 0, 97], [5, 0, 103], [5, 0, 97]]


def test_the_rig_refuses_more_cameras_than_it_has():
    with pytest.raises(ValueError, match="1 to 4"):
        thesis_rig(5)

"""What the page says of a calibration is what the records hold, rounded to its uncertainty, with units."""

from vidtrack.report.calibration_sections import accuracy_section, camera_section, stability_section

CAMERA = {
    "camera": "cam1",
    "model": "tsai",
    "refine": "full",
    "n_points": 63,
    "n_sighted": 64,
    "rms_px": 0.22709,
    "max_px": 0.558,
    "dx": 0.0172,
    "dy": 0.01375,
    "Cx": 264.4215,
    "Cy": 227.974,
    "f": 10.95027,
    "Sx": 1.01947,
    "kappa1": 0.000748792,
    "position": [-79.2129, 1.0, 2.0],
    "position_sd": [1.2570, 1.0, 1.0],
    "standard_errors": {"Cx": 5.127, "f": 0.07185, "kappa1": 0.00024984, "omega_x": 0.0072},
}


def test_parameters_are_rounded_to_their_standard_errors_and_have_units():
    rows = {row[0]: row[1:] for row in camera_section(CAMERA, [], {}, "in").tables[0].rows}
    assert rows["kappa1"] == ["0.00075", "0.00025", "mm⁻²"]
    assert rows["Cx"] == ["264.4", "5.1", "px"]
    assert rows["f"] == ["10.950", "0.072", "mm"]
    assert rows["Cy"] == ["227.974", "–", "px"]
    assert rows["position x"] == ["-79.2", "1.3", "in"]
    assert rows["omega_x"] == ["–", "0.0072", "rad"]


def test_without_a_sensor_lengths_in_the_camera_are_px():
    section = camera_section({**CAMERA, "dx": 1, "dy": 1}, [], {}, "in")
    assert {row[0]: row[3] for row in section.tables[0].rows}["kappa1"] == "px⁻²"


def test_points_that_were_not_used_are_listed_with_their_reason():
    points = [{"tag": "3", "Xf": 12.34567, "Yf": 5.0, "used": False, "reason": "swapped with tag 4"}]
    points.append({"tag": "4", "Xf": 1.0, "Yf": 5.0, "used": True, "reason": ""})
    table = camera_section(CAMERA, points, {}, "in").tables[1]
    assert table.rows == [["3", "12.346", "5", "swapped with tag 4"]]


def test_the_errors_of_points_held_out_stand_beside_those_of_points_used():
    by_axis = {"x": 0.01, "y": 0.02, "z": 0.03}
    back = {"n_points": 64, "mean_abs": by_axis, "max_abs": by_axis, "mean_3d": 0.049, "max_3d": 0.1}
    back |= {"largest_distance": 60.0, "diagonal_field": 160.0, "worst": {"x": {"tag": "2", "error": -0.08}}}
    back |= {"held_out": {"method": "leave-one-out", "mean_abs": by_axis, "max_abs": by_axis, "mean_3d": 0.054}}
    section = accuracy_section(back, "in")
    table = section.tables[0]
    assert table.rows[0] == ["x", "0.01", "0.01", "0.01", "0.01", "–"]
    assert table.rows[3][:4] == ["in space", "0.049", "0.1", "0.054"]
    assert section.tables[1].rows[0] == ["x", "0.017 %", "0.0063 %", "2", "-0.08"]
    assert "The centroid noise cannot be estimated" in section.lines[2]


def test_a_camera_whose_movement_is_not_known_says_so():
    moved = {"moved": True, "distance": 0.5, "distance_sd": 0.01, "picture_shift_px": {"mean": 3.2}}
    rows = stability_section({"cameras": {"a": moved, "b": {"moved": None}}}, "in").tables[0].rows
    assert rows[0] == ["a", "yes", "0.5", "0.01", "–", "–", "3.2"]
    assert rows[1][1] == "not known"


def test_interfaces_are_shown_with_how_far_the_points_move_them():
    known = {"name": "window", "point": [0, 0, 0], "normal": [0, 1, 0], "thickness": [0.5], "indices": [1, 1.49, 1.333]}
    sigma = {f"window.{k}": v for k, v in (("position", 0.2), ("tilt_1", 0.01), ("tilt_2", 0.01))}
    sigma |= {"window.thickness_1": 0, "window.index_1": 0, "window.index_2": 0}
    moved = {**known, "point": [0, 0.1, 0], "sigma": sigma, "known": {**known, "sigma": sigma}}
    errors = {"window.position": 0.05, "window.tilt_1": 0.002, "window.tilt_2": 0.002}
    camera = {**CAMERA, "through": [moved], "standard_errors": errors}
    tables = camera_section(camera, [], {}, "in").tables
    rows = {row[1]: row[2:] for row in tables[1].rows}
    assert rows["position"] == ["0.100", "0.050", "0.2", "in"]
    assert rows["tilt 1"][1:] == ["0.11", "0.57", "deg"]
    assert rows["index 2"][2:] == ["held", ""]
    assert not any("window" in row[0] for row in tables[0].rows)


def test_a_board_s_part_in_a_calibration_is_said_with_what_it_gains():
    board = {"views": 30, "views_offered": 90, "held_out_px": {"tsai": 0.1234, "brown": 0.1312}}
    tied = {"cameras": [["cam1", "cam2"]], "sigma": 0.3412, "alone_sigma": 0.9021}
    lines = camera_section({**CAMERA, "board": board, "bundle": {"board": tied}}, [], {}, "mm").lines
    assert any("30 of 90 views" in line and "tsai 0.12, brown 0.13" in line for line in lines)
    assert any("cam1, cam2" in line and "0.34 mm" in line and "0.9 mm without the board" in line for line in lines)
    assert not any("board" in line for line in camera_section(CAMERA, [], {}, "mm").lines)

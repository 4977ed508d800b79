"""A wand, a body that refined the cameras and coded tags: what was measured, what was held out, whether it helped."""

from vidtrack.report.ways_sections import body_section, tags_table, wand_section

WAND = {
    "lengths": {"A-B": 20.0},
    "moments": 346,
    "left_out": 2,
    "axes": {"from": "up", "heading": "first camera", "gravity": {"value": 386.1, "sd": 0.4, "samples": 60}},
    "clocks": {"cam2": {"offset_s": 0.0125, "sd_s": 0.0002}},
    "model": "tsai",
    "held_out": [
        {"model": "tsai", "held_out": 0.0076, "length_rms": 0.0083},
        {"model": "brown", "held_out": 0.0077, "length_rms": 0.0084},
    ],
    "sigma_px": 0.014,
    "diagonal_field": 75.0,
    "length_rms": 0.0075,
    "length_ratio": 1.05,
}
BODY = {
    "body": "float",
    "runs": ["heave"],
    "moments": 149,
    "sigma": 0.005,
    "used": True,
    "held_out": {"residual_px": {"before": 0.0143, "after": 0.0091}, "distance": {"before": 0.0039, "after": 0.0038}},
    "sigma_of_calibration": {"before": 0.0028, "after": 0.0024},
    "shape": {"distances": {"bow-port": {"stated": 16.553, "seen": 16.555, "sd": 0.0076}}},
}
TAG = {"tags": [7], "samples": 6, "located": 5, "one_camera": 0.5, "rms_px": 0.0084, "sd_grown": 1.0}


def test_a_wand_has_its_lengths_its_scatter_its_axes_and_the_lens_that_was_chosen():
    section = wand_section(WAND, "in")
    text = " ".join(section.lines)
    assert "346 moments" in text
    assert "lengths 20 in" in text
    assert "1/10,000 of the volume" in text
    assert "up as measured, x as the first camera looks" in text
    assert "386.1 ± 0.4 in/s²" in text
    held, clocks = section.tables
    assert [row[0] for row in held.rows if row[3] == "used"] == ["tsai"]
    assert clocks.rows == [["cam2", "12.5", "0.2"]]


def test_a_wand_in_the_axes_of_points_says_the_scale_that_they_give():
    axes = {"from": "points", "points": ["a", "b", "c"], "scale": 1.0002, "scale_sd": 0.0004, "rms": 0.1}
    line = wand_section(WAND | {"axes": axes, "clocks": {}}, "in").lines[2]
    assert "(3 of them)" in line
    assert "1.0002 ± 4·10⁻⁴" in line or "1.0002 ± 0.0004" in line


def test_a_body_says_whether_it_helped_and_by_how_much_held_out():
    section = body_section(BODY, "in")
    assert "It refined the cameras" in section.lines[0]
    helped, distances = section.tables
    assert [row[1:] for row in helped.rows] == [["0.0143", "0.0091"], ["0.0039", "0.0038"], ["0.0028", "0.0024"]]
    assert distances.rows == [["bow-port", "16.553", "16.555", "0.0076"]]


def test_a_body_that_was_not_used_has_no_table_of_a_gain():
    record = {"body": "float", "runs": ["a"], "moments": 3, "sigma": 0.1, "used": False}
    section = body_section(record, "mm")
    assert "stay as they were" in section.lines[0]
    assert section.tables == []


def test_tags_say_how_often_they_were_located_and_their_size():
    record = {"bodies": {"float": TAG | {"size": {"factor": 0.99993, "factor_sd": None}}, "other": {"samples": 3}}}
    table = tags_table(record)
    assert table.rows == [["float", "7", "83.33 %", "50 %", "0.0084", "1", "0.99993"]]
    assert tags_table({"bodies": {"other": {}}}) is None
    assert tags_table({"bodies": {"float": TAG | {"size": None}}}).rows[0][-1] == "–"

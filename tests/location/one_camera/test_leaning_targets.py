import pytest

from vidtrack.location.one_camera.leaning_targets import leaning_targets
from vidtrack.timing.readout import Readout

FRAME = 1 / 30
SIZE = (960, 540)


def lean(ms, sd_ms=0.5, rows=540):
    return {"later": ms / 1e3 / FRAME / rows, "sd": sd_ms / 1e3 / FRAME / rows}


def findings(own, readout=None, reported=()):
    readouts = {"cam1": readout or Readout(0.0, SIZE)}
    return leaning_targets({"cam1": own}, readouts, {"cam1": FRAME}, reported)


def test_a_rolling_shutter_that_nothing_else_says_is_told():
    (found,) = findings(lean(16))
    assert (found.level, found.code) == ("doubtful", "rolling-shutter")
    assert "cam1: its rows are read one after the other" in found.text
    assert "16 ± 2 ms" in found.text
    assert "cameras.cam1.readout_ms: about 16" in found.cure


@pytest.mark.parametrize(
    ("own", "seconds"),
    [
        (None, 0.0),
        (lean(2), 0.0),  # within what shapes show too much
        (lean(16, 4), 0.0),  # not sure
        (lean(50), 0.0),  # longer than from picture to picture
        (lean(15), 0.016),  # as it is used
    ],
)
def test_nothing_is_told_of_what_shapes_do_not_show_or_what_is_used_already(own, seconds):
    assert findings(own, Readout(seconds, SIZE)) == []


def test_a_read_out_that_is_given_wrongly_is_told():
    (found,) = findings(lean(16), Readout(0.030, SIZE))
    assert "where 30 ms are assumed" in found.text


def test_what_the_motion_shows_is_not_told_twice():
    told = [{"code": "rolling-shutter", "text": "cam1: its rows are read one after the other"}]
    assert findings(lean(16), reported=told) == []


@pytest.mark.parametrize(
    ("rotation", "mirrored", "sign", "length"),
    [(0, False, 1, 540), (180, False, -1, 540), (90, False, 1, 960), (270, False, -1, 960), (90, True, -1, 960)],
)
def test_rows_are_those_of_the_stored_picture(rotation, mirrored, sign, length):
    (found,) = findings(lean(sign * 16, rows=length), Readout(0.0, SIZE, rotation, mirrored))
    assert "as in 16 ± 2 ms" in found.text

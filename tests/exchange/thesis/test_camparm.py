import numpy as np
import pytest

from tests.exchange.thesis.rig import FIXED
from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.camparm import Camparm, read_camparm, write_camparm

TYPED = """camera parameters, wave basin
Ncx Ncy Nfx Cx Cy sensx sensy
510 492 512 259.5 241.25 8.8 6.6   left
510 492 512 256.0 240.0 8.8 6.6   right
148.2 151.7
"""


def test_a_file_that_was_typed_by_hand_is_read(tmp_path):
    path = tmp_path / "camparm.dat"
    path.write_bytes(TYPED.replace("\n", "\r\n").encode() + b"\x1a")
    found = read_camparm(path)
    assert found.cameras[0] == FIXED
    assert found.cameras[1].Cx == 256.0
    assert found.field == (148.2, 151.7)
    assert found.cameras[0].dx == pytest.approx(8.8 / 512)
    assert found.cameras[0].dy == pytest.approx(6.6 / 492)


def test_a_line_of_text_may_stand_between_the_cameras(tmp_path):
    path = tmp_path / "camparm.dat"
    path.write_text(TYPED.replace("510 492 512 256.0", "the right one:\n510 492 512 256.0"))
    assert read_camparm(path).cameras[1].Cx == 256.0


def test_what_is_written_is_read_to_the_last_digit(tmp_path):
    path = tmp_path / "camparm.dat"
    rng = np.random.default_rng(1)
    cameras = tuple(FIXED._replace(Cx=float(rng.uniform(200, 300)), width=float(rng.uniform(5, 9))) for _ in range(2))
    write_camparm(path, Camparm(cameras, (1 / 3, 151.7)))
    found = read_camparm(path)
    assert found.cameras == cameras
    assert found.field == (1 / 3, 151.7)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "empty"),
        ("one line", "1 lines"),
        ("a\nb\n510 492 512 259.5\n", "4 numbers"),
        ("a\nb\nc\n", "no line"),
        (TYPED.replace("8.8 6.6   left", "0 6.6"), "not positive"),
    ],
)
def test_what_is_no_camparm_is_refused_in_one_line(tmp_path, text, what):
    path = tmp_path / "camparm.dat"
    path.write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_camparm(path)
    assert "\n" not in str(error.value)

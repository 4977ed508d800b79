import numpy as np
import pytest

from tests.exchange.cameras.rig import said
from tests.exchange.thesis.rig import FIXED, cameras, points
from vidtrack.errors import VidtrackError
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.thesis.outcam import outcam_of, write_outcam
from vidtrack.geometry.camera import project

KNOWN = {"size": (512, 492), "Cx": FIXED.Cx, "Cy": FIXED.Cy, "sensor": (8.8, 6.6), "world": "in"}


def test_the_thesis_calibration_needs_what_camparm_has(tmp_path):
    camera = cameras()[0]
    out, _, worst = outcam_of(camera)
    write_outcam(tmp_path / "cam1.prn", out)
    given = read_camera(tmp_path / "cam1.prn", said(**KNOWN))
    np.testing.assert_allclose(project(given.camera, points()), project(camera, points()), atol=worst + 1e-5)
    for key in ("Cx", "Cy", "sensor"):
        with pytest.raises(VidtrackError, match=rf"config.yaml: cameras\.cam1\.{key}: it is in camparm.dat"):
            read_camera(tmp_path / "cam1.prn", said(**{**KNOWN, key: None}))


@pytest.mark.parametrize(
    ("name", "text", "what"),
    [
        ("cam1.csv", "1 800 1280 720 639 359 1 0 0 0 0 0\n", "an Argus camera profile, a lens without a pose"),
        ("cam1.json", "{}", "no camera of a program that is known"),
        ("cam1.toml", "", "empty"),
        ("cam1.xml", "<a/>", "no chunk"),
    ],
)
def test_what_is_no_camera_is_refused_in_one_line(tmp_path, name, text, what):
    (tmp_path / name).write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read_camera(tmp_path / name, said())
    assert "\n" not in str(error.value)

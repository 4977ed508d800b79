"""What is written as another program's file is read back from it by vidtrack's own readers as what it was."""

import json

import numpy as np
import pytest

from tests.exchange.runs import NAMES, bodies, camera, run, times, trajectories
from tests.exchange.test_digitised import CAMERAS, digitised_run
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said, in_world
from vidtrack.exchange.formats import written
from vidtrack.exchange.points.formats import read_measured
from vidtrack.geometry.camera import project

OWN = camera("cam1", kappa1=8e-4)


def save(folder, form, own):
    files = written(form, own).files
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return files


@pytest.mark.parametrize(
    ("form", "file", "said"),
    [
        ("opencv", "cam1.yml", {"units": "in"}),
        ("anipose", "calibration.toml", {"units": "in"}),
        ("metashape", "cameras.xml", {"units": "in"}),
        ("openptv", "cam1.tif.ori", {"size": (512, 480), "units": "mm"}),
    ],
)
def test_a_camera_comes_back_to_what_its_file_states(tmp_path, form, file, said):
    files = save(tmp_path, form, run(cameras={"cam1": OWN}))
    if form == "openptv":
        record = json.loads(files["cam1.json"])
        said = said | {"sensor": (record["imx"] * record["pix_x"], record["imy"] * record["pix_y"])}
    given = Said("cam1", "in", **said)
    back = in_world(read_camera(tmp_path / file, given), given)
    p, b = seen_by(OWN)
    off = np.linalg.norm(project(back, p) - b, axis=-1)
    assert off.max() < 0.05
    np.testing.assert_allclose(back.position, OWN.position, atol=1e-6)


def test_dlt_coefficients_come_back_as_the_pinhole_that_they_are(tmp_path):
    save(tmp_path, "dltdv8", digitised_run())
    own = CAMERAS["cam2"].without_lens()
    given = Said("cam2", "in", camera="2", origin="upper-left", first=(1.0, 1.0), size=(512, 480), units="in")
    back = in_world(read_camera(tmp_path / "pluck_dltcoefs.csv", given), given)
    p, b = seen_by(own)
    np.testing.assert_allclose(project(back, p), b, atol=1e-6)


def test_points_of_c3d_come_back_to_the_last_digit(tmp_path):
    save(tmp_path, "c3d", run())
    back = read_measured(tmp_path / "pluck.c3d")
    assert (back.names, back.unit) == (NAMES, "mm")
    for k, name in enumerate(NAMES):
        table = trajectories()
        own = table[table["target"] == name].set_index("time_s")[["x", "y", "z"]].reindex(times())
        np.testing.assert_array_equal(back.p[:, k].astype(np.float32), (own.to_numpy() * 25.4).astype(np.float32))


def test_places_of_qtm_come_back_to_the_digits_written(tmp_path):
    save(tmp_path, "qtm", run())
    back = read_measured(tmp_path / "pluck_6D.tsv")
    own = bodies().set_index("time_s")[["x", "y", "z"]].reindex(times())
    np.testing.assert_allclose(back.p[:, 0], own * 25.4, atol=6e-7)
    np.testing.assert_allclose(np.diff(back.time_s), np.diff(times()), atol=1.1e-5)
    back = read_measured(tmp_path / "pluck_3D.tsv")
    assert back.names == NAMES

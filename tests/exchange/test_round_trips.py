"""What is written as another program's file is read back from it by vidtrack's own readers as what it was."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.exchange.runs import NAMES, bodies, camera, run, times, trajectories
from tests.exchange.test_digitised import AHEAD, CAMERAS, digitised_run, paths
from tests.exchange.test_ideal_to_distorted import seen_by
from vidtrack.exchange.cameras.argus import read_profiles
from vidtrack.exchange.cameras.formats import read_camera
from vidtrack.exchange.cameras.given import Said, in_world
from vidtrack.exchange.formats import FORMATS, written
from vidtrack.exchange.lens_files import read_lens
from vidtrack.exchange.points.formats import read_measured
from vidtrack.exchange.tracks.digitised import Convention, placed
from vidtrack.exchange.tracks.formats import read_tracks
from vidtrack.geometry.brown import distorted
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


@pytest.mark.parametrize(
    ("form", "file", "said"),
    [
        ("dltdv8", "pluck_xypts.csv", {}),
        ("dltdv7", "pluck_xypts.csv", {"origin": "lower-left"}),
        ("argus", "pluck-xypts.csv", {}),
    ],
)
@pytest.mark.parametrize("camera", ["1", "2", "3"])
def test_digitised_points_come_back_to_the_last_digit(tmp_path, form, file, said, camera):
    save(tmp_path, form, digitised_run())
    how = Convention(camera=camera, size=(512, 480), **said)
    back = read_tracks(tmp_path / file, how, "here")
    expected = project(CAMERAS[f"cam{camera}"], paths())
    expected[: max(0, -AHEAD[f"cam{camera}"])] = np.nan  # moments before the camera's first picture
    np.testing.assert_array_equal(back.frame, np.arange(40))
    np.testing.assert_allclose(placed(back, how, "here"), expected, rtol=0, atol=2e-13)


def test_the_lens_of_an_argus_profile_comes_back_to_its_digits(tmp_path):
    files = save(tmp_path, "argus", digitised_run())
    name = next(name for name in files if "profile" in name)
    profiles = read_profiles(tmp_path / name)
    rows = np.loadtxt(tmp_path / name)
    back = [(p.number, p.lens.fx, *p.lens.image_size, p.lens.cx, p.lens.cy, p.lens.fy / p.lens.fx) for p in profiles]
    np.testing.assert_allclose(back, rows[:, :7], rtol=1e-15)
    np.testing.assert_array_equal([(*p.lens.k[:2], p.lens.p1, p.lens.p2, p.lens.k[2]) for p in profiles], rows[:, 7:])


def test_the_lens_of_colmap_comes_back_to_what_its_file_states(tmp_path):
    save(tmp_path, "colmap", run(cameras={"cam1": OWN}))
    lens = read_lens(str(tmp_path / "cameras.txt"), "cam1")[0]
    p, b = seen_by(OWN)
    c = p @ OWN.R.T + OWN.T
    assert np.linalg.norm(distorted(lens, c[:, :2] / c[:, 2:]) - b, axis=-1).max() < 0.02


def test_the_documentation_has_a_round_trip_and_a_reader_of_each_format():
    """Each row names a test that exists, and each format that is written has a row."""
    page = (Path(__file__).parents[2] / "docs/formats.md").read_text()
    table = page.split("## Round trips")[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if line.startswith("| `")]
    named = {form for row in rows for form in re.findall(r"`(\w+)`", row[0])}
    assert named == set(FORMATS)
    here = Path(__file__).parent
    for row in rows:
        for file, test in re.findall(r"`([\w/]+\.py)::(\w+)`", row[-1]):
            assert f"def {test}(" in (here / file).read_text(), (file, test)
        assert "::" in row[-1], row[0]

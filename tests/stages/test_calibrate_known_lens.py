"""A camera with a known lens from few points, as the stage gives it: the camera, its record and what it says."""

import numpy as np
import pandas as pd
import pytest

from vidtrack.calibration.camera.known_lens import KnownLens
from vidtrack.errors import VidtrackError
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig
from vidtrack.stages.calibrate import calibrate

CAMERA = thesis_rig(1)[0]
ALL = thesis_points()[1]
LENS = KnownLens(CAMERA, "tsai", source="lens.yml", largest_px=0.01, rms_px=0.001)
ROWS = [0, 3, 15, 22, 40, 60, 37, 51, 9, 28]


def sightings(n, seed=0, noise=0.1, camera=CAMERA):
    p = ALL[ROWS[:n]]
    b = project(camera, p) + np.random.default_rng(seed).normal(0, noise, (n, 2))
    table = pd.DataFrame({"tag": [f"g{i}" for i in range(n)], **dict(zip("xyz", p.T, strict=True))})
    return table.assign(Xf=b[:, 0], Yf=b[:, 1], sd_x=noise, sd_y=noise, pixels=0)


def placed(table, lens=LENS, **how):
    return calibrate(table, image_size=CAMERA.image_size, camera="cam1", lens=lens, **how)


def codes(found):
    return {finding.code for finding in found.findings}


def test_five_points_give_a_camera_with_the_lens_that_was_given():
    found = placed(sightings(5))
    assert (found.camera.f, found.camera.Cx, found.camera.kappa1) == (CAMERA.f, CAMERA.Cx, CAMERA.kappa1)
    assert np.linalg.norm(found.camera.position - CAMERA.position) < 0.5
    assert found.uncertainty.names == ("omega_x", "omega_y", "omega_z", "t_x", "t_y", "t_z")
    assert found.record["lens"]["source"] == "lens.yml"
    assert found.record["lens"]["use"] == "fixed"
    assert {f.level for f in found.findings} == {"note"}
    assert len(found.search) == 0


def test_the_word_on_the_lens_has_the_px_of_its_conversion():
    (text,) = [f.text for f in placed(sightings(5)).findings if f.code == "lens-known"]
    assert "0.01 px at most" in text
    assert "lens-converted-roughly" in codes(placed(sightings(5), LENS._replace(largest_px=0.7)))


def test_a_lens_with_a_covariance_is_a_prior_and_the_record_has_it():
    found = placed(sightings(8), LENS._replace(names=("f", "Cx"), covariance=np.diag([0.01, 1.0])))
    assert found.uncertainty.names[-2:] == ("f", "Cx")
    assert found.record["lens"]["mean"]["f"] == CAMERA.f
    assert found.record["lens"]["use"] == "prior"


def test_what_fix_gives_counts_before_the_lens():
    assert placed(sightings(6), fix={"f": CAMERA.f * 1.0001}).camera.f == pytest.approx(CAMERA.f * 1.0001)


def test_a_wrong_point_among_seven_is_left_out_and_named():
    table = sightings(7)
    table.loc[4, "Xf"] += 12
    found = placed(table)
    assert found.points.loc[~found.points["used"], "tag"].tolist() == ["g4"]
    assert np.linalg.norm(found.camera.position - CAMERA.position) < 0.5


def test_a_wrong_point_among_five_makes_the_camera_bad():
    table = sightings(5)
    table.loc[2, "Xf"] += 40
    assert [f.level for f in placed(table).findings if f.code == "point-suspect"] == ["bad"]


def test_a_lens_of_another_zoom_is_contradicted():
    found = placed(sightings(10), LENS._replace(camera=CAMERA.with_(f=1.3 * CAMERA.f)))
    assert "lens-contradicted" in codes(found)
    assert "lens-contradicted" not in codes(placed(sightings(10)))


@pytest.mark.parametrize(
    ("table", "how", "line"),
    [
        (sightings(3), {}, "3 usable calibration points; placing a camera whose lens is known needs 4"),
        (sightings(5).assign(x=lambda t: -t["x"]), {}, "mirrored axes"),
        (sightings(9).assign(x=lambda t: -t["x"]), {}, "mirrored axes"),
        (sightings(6), {"refine": "linear"}, "the closed form takes no known lens"),
        (sightings(6), {"prior": {"f": (8.0, 0.1)}}, "a prior beside a known lens"),
        (sightings(6).assign(x=1.0, y=2.0), {}, "lie on one line"),
    ],
)
def test_what_gives_no_camera_is_one_line(table, how, line):
    with pytest.raises(VidtrackError, match=line) as caught:
        placed(table, **how)
    assert len(caught.value.problems) == 1

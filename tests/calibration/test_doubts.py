"""What is said of a camera that can be had: of its lens, of points left out, of a lens that does not fit."""

import numpy as np
import pytest

from vidtrack.calibration.camera.initial_fit import Nominal
from vidtrack.calibration.camera.known_lens import KnownLens
from vidtrack.calibration.camera.one_camera import Answer, Inliers, Points, Task, calibrated
from vidtrack.calibration.camera.outliers import Mixup
from vidtrack.calibration.doubts import doubts, lens_findings, mirrored_place, outlier_findings
from vidtrack.geometry.camera import project
from vidtrack.simulate.rig import thesis_points, thesis_rig

CAMERA = thesis_rig(1)[0]
NOMINAL = Nominal(255.5, 239.5, CAMERA.dx, CAMERA.dy, CAMERA.image_size)
LENS = KnownLens(CAMERA, "tsai", source="lens.yml")
TAGS = [f"g{i}" for i in range(64)]


def sighted(camera=CAMERA, n=64, noise=0.1) -> Points:
    p = thesis_points()[1][:: 64 // n][:n]
    return Points(p, project(camera, p) + np.random.default_rng(0).normal(0, noise, (n, 2)))


def task(refine="full", model="tsai", lens=None) -> Task:
    return Task(NOMINAL, model, refine, {}, {}, lens=lens)


@pytest.fixture(scope="module")
def plain() -> tuple[Points, Answer]:
    points = sighted()
    return points, calibrated(points, task())


def with_lens(points: Points, lens=LENS) -> list[str]:
    return [f.code for f in lens_findings(lens, calibrated(points, task(lens=lens)), points, TAGS, "in")]


def kept(out=()) -> Inliers:
    keep = ~np.isin(np.arange(64), out)
    return Inliers(keep, 0.1, CAMERA, "tsai", keep)


def test_points_that_fit_a_good_lens_give_no_doubt(plain):
    points, answer = plain
    assert doubts(points, points, task(), answer, "in") == []


def test_a_lens_that_the_points_bear_out_is_only_noted():
    assert with_lens(sighted()) == ["lens-known"]


def test_a_lens_converted_with_more_than_a_tenth_of_a_pixel_is_a_doubt():
    assert with_lens(sighted(), LENS._replace(largest_px=0.11)) == ["lens-known", "lens-converted-roughly"]
    assert with_lens(sighted(), LENS._replace(largest_px=0.09)) == ["lens-known"]


def test_a_lens_of_another_focal_length_is_contradicted_by_eight_points_and_not_by_seven():
    other = CAMERA.with_(f=1.1 * CAMERA.f)
    assert "lens-contradicted" in with_lens(sighted(other, noise=0.01))
    assert "lens-contradicted" in with_lens(sighted(other, n=8, noise=0.01))
    assert "lens-contradicted" not in with_lens(sighted(other, n=7, noise=0.01))


def test_a_world_that_is_mirrored_is_known_by_how_well_its_mirror_fits():
    points = sighted()
    mirrored = points._replace(p=points.p * [-1.0, 1.0, 1.0])
    assert mirrored_place(LENS, mirrored, sigma_px=30.0)
    assert not mirrored_place(LENS, points, sigma_px=0.1)


def test_a_swap_is_named_once_and_its_points_are_no_further_outliers(plain):
    points, answer = plain
    pairs = [Mixup(3, 8, mutual=True), Mixup(8, 3, mutual=True)]
    found = outlier_findings(TAGS, points, kept([3, 8]), np.zeros((64, 2)), pairs, answer, known_lens=False)
    assert len(found) == 1
    assert "g3" in found[0].text
    assert "g8" in found[0].text


def test_a_point_left_out_is_named_with_its_distance(plain):
    points, answer = plain
    errors = np.zeros((64, 2))
    errors[5] = 3.0, 4.0
    (found,) = outlier_findings(TAGS, points, kept([5]), errors, [], answer, known_lens=False)
    assert "up to 5 px off: tags g5" in found.text


@pytest.mark.parametrize(("n", "known_lens", "noted"), [(11, False, True), (12, False, False), (6, True, False)])
def test_too_few_points_to_find_an_outlier_among_are_noted(plain, n, known_lens, noted):
    points, answer = plain
    keep = np.ones(n, bool)
    some = Inliers(keep, 0.1, CAMERA, "tsai", keep)
    found = outlier_findings(
        TAGS[:n], points.take(np.arange(n)), some, np.zeros((n, 2)), [], answer, known_lens=known_lens
    )
    assert [f.code for f in found] == ["outliers-not-sought"] * noted


def test_a_lens_richer_than_the_model_is_said_to_be():
    points = sighted(CAMERA.with_(kappa1=-4e-4, kappa2=3e-4, p1=4e-3), noise=0.02)
    answer = calibrated(points, task())
    assert "lens-model-too-plain" in [f.code for f in doubts(points, points, task(), answer, "in")]
    rich = task(model="brown")
    again = calibrated(points, rich)
    assert "lens-model-too-plain" not in [f.code for f in doubts(points, points, rich, again, "in")]


@pytest.mark.parametrize(
    "given", [{"priors": {"f": (1.15 * CAMERA.f, 0.001)}}, {"fixed": {"f": 1.1 * CAMERA.f}}, {"fixed": {"Cx": 120.0}}]
)
def test_what_the_config_says_of_the_lens_and_the_points_contradict_is_named(given):
    points = sighted()
    told = task()._replace(**given)
    (found,) = [
        f for f in doubts(points, points, told, calibrated(points, told), "in") if f.code == "settings-contradicted"
    ]
    (name,) = next(iter(given.values()))
    without = float(found.text.split(f"without them {name} ")[1].split(",")[0])
    assert without == pytest.approx(getattr(CAMERA, name), rel=0.02)


def test_what_the_config_says_rightly_or_of_few_points_is_not_contradicted():
    right = task()._replace(priors={"f": (1.001 * CAMERA.f, 0.01)}, fixed={"Sx": CAMERA.Sx})
    for points, told in ((sighted(), right), (sighted(n=12), task()._replace(fixed={"f": 1.1 * CAMERA.f}))):
        found = doubts(points, points, told, calibrated(points, told), "in")
        assert "settings-contradicted" not in [f.code for f in found]


def test_points_in_one_plane_are_noted_with_the_scale_that_is_held():
    p = thesis_points()[1].copy()
    p[:, 2] = 0.3 * p[:, 0]
    points = Points(p, project(CAMERA, p) + np.random.default_rng(1).normal(0, 0.05, (64, 2)))
    held = task()._replace(fixed={"Sx": 1.0, "Cx": 255.5, "Cy": 239.5})
    found = doubts(points, points, held, calibrated(points, held), "in")
    (note,) = [f for f in found if f.code == "points-coplanar"]
    assert note.level == "note"
    assert "Sx held at 1" in note.text

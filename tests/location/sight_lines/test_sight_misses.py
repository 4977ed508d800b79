"""Lines of sight that miss by more than noise and calibration explain are noticed, and their cause is named."""

import numpy as np
import pytest

from vidtrack.calibration.camera.refine import free_parameters, refine
from vidtrack.geometry.camera import project
from vidtrack.geometry.rotation import rotation_from_vector
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines.sight_misses import sight_misses, with_misses
from vidtrack.simulate.rig import thesis_points, thesis_rig

AT = np.arange(240) / 30
NOISE = 0.05


def pluck(t):
    swing = [24 * np.cos(2 * np.pi * t / 1.6), 0.6 * np.sin(2 * np.pi * t / 0.9), 0.4 * np.cos(2 * np.pi * t / 1.1)]
    return np.exp(-0.1 * t)[:, None] * np.stack(swing, -1)


def misses(n, *, roll=0.0, late=0.0, zoom=(), seed=0, known=True, lost=(), path=pluck, aside=0.0, unsure=()):
    """Of a run of n cameras, the second of which turned about its axis (deg) or is late (s, at all AT) since.

    zoom   camera: share by which its focal length grew since; aside: px by which it sees all too low
    unsure samples of the first camera whose sd is 100 times as large
    """
    rng = np.random.default_rng(seed)
    points, cameras, uncertainties, b = thesis_points()[1], [], [], []
    for i, camera in enumerate(thesis_rig(n)):
        seen = project(camera, points) + rng.normal(0, 0.02, (len(points), 2))
        fit = refine(camera, points, seen, free=free_parameters("tsai"), sd=0.02)
        cameras.append(fit.camera)
        uncertainties.append(fit.uncertainty if known else None)
        R = rotation_from_vector([0, 0, np.radians(roll * (i == 1))]) @ camera.R
        moved = camera.with_(R=R, T=-R @ camera.position, f=camera.f * (1 + dict(zoom).get(i, 0.0)))
        b.append(project(moved, path(AT + late * (i == 1))) + rng.normal(0, NOISE, (AT.size, 2)))
        b[i][:, 1] += aside * (i == 1)
    b = np.stack(b)[:, None]
    for camera, moments in lost:
        b[camera, :, moments] = np.nan
    sd = np.full(b.shape, NOISE)
    sd[0, :, list(unsure)] *= 100
    located = locate_points(cameras, b, sd=sd, uncertainties=uncertainties, reject=3.0)
    off = np.linalg.norm(located.point[0] - path(AT), axis=-1)
    over = np.sqrt(np.nanmean(off**2) / np.nanmean((located.sigma[0] ** 2).sum(-1)))
    return sight_misses(cameras, uncertainties, None, located, b, sd, AT), over


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_a_rig_that_holds_leaves_what_is_expected_and_no_evidence(n, seed):
    found, over = misses(n, seed=seed)
    assert found.px == pytest.approx(found.expected_px, rel=0.2)
    assert found.beyond == pytest.approx(over, abs=0.2)
    assert found.cause.evidence < 3


@pytest.mark.parametrize("n", [2, 3])
def test_what_is_off_alike_in_all_samples_is_evidence(n):
    """Allowing for what a lamp may leave there hid cameras that had turned: positions were off by 20 sigma."""
    assert misses(n, aside=0.15)[0].cause.evidence > 12


@pytest.mark.parametrize("n", [2, 3])
def test_a_camera_that_rolled_by_a_degree_is_named_with_its_angle_though_it_misses_by_a_fifth_of_a_pixel(n):
    found, over = misses(n, roll=1.3)
    assert found.px.max() < 0.3
    assert over > 10
    assert (found.cause.kind, found.cause.cameras[0]) == ("turned", 1)
    assert found.cause.amount == pytest.approx(1.3, abs=3 * found.cause.sd)
    assert found.cause.moved == pytest.approx(over, rel=0.2)
    assert found.cause.evidence > 100


@pytest.mark.parametrize("n", [2, 3])
def test_samples_that_are_hardly_known_hide_nothing_in_the_others(n):
    """Errors of all samples over the sigma of all were those of the few, and a rolled camera was off by half of one."""
    found, _ = misses(n, roll=1.3, unsure=range(0, AT.size, 10))
    well, over = misses(n, roll=1.3)
    assert over > 10
    assert found.beyond == pytest.approx(well.beyond, rel=0.1)
    assert found.cause.moved == pytest.approx(well.cause.moved, rel=0.2)
    assert found.px == pytest.approx(well.px, rel=0.1)
    assert found.expected_px == pytest.approx(well.expected_px, rel=0.2)


def test_a_clock_that_is_late_is_named_with_its_delay():
    found, over = misses(3, late=0.016)
    assert (found.cause.kind, found.cause.cameras) == ("late", (1,))
    assert found.cause.amount == pytest.approx(0.016, abs=2e-4)
    assert found.cause.moved == pytest.approx(over, rel=0.1)


@pytest.mark.parametrize(
    ("n", "zoom", "kind"),
    [(3, {1: 0.01}, "zoomed"), (2, {1: 0.01}, "zoomed"), (3, dict.fromkeys(range(3), 0.05), "all zoomed")],
)
def test_a_lens_that_was_zoomed_or_focused_again_is_named_with_the_share(n, zoom, kind):
    found, over = misses(n, zoom=zoom.items())
    assert over > 3
    assert found.cause.kind == kind
    assert set(zoom) <= set(found.cause.cameras)
    assert found.cause.amount == pytest.approx(zoom[1], rel=0.15)
    assert found.cause.evidence > 30
    assert found.cause.share > 0.5


def test_of_two_cameras_either_clock_may_be_the_late_one():
    assert set(misses(2, late=0.016)[0].cause.cameras) == {0, 1}


def test_it_needs_no_uncertainty_and_stands_lost_samples():
    found, _ = misses(3, roll=1.3, known=False, lost=[(0, slice(0, 60)), (1, slice(50, 90)), (2, slice(200, 240))])
    assert (found.cause.kind, found.cause.cameras) == ("turned", (1,))
    assert np.isfinite(found.px).all()


def test_few_samples_say_nothing():
    cameras = thesis_rig(2)
    b = np.stack([project(c, pluck(AT[:9])) for c in cameras])[:, None]
    sd = np.full(b.shape, NOISE)
    assert sight_misses(cameras, [None] * 2, None, locate_points(cameras, b, sd=sd), b, sd, AT[:9]) is None


def round_path(t):
    return np.stack([14 * np.cos(2 * np.pi * t / 1.6), 3 * np.sin(5 * t), 12 * np.sin(2 * np.pi * t / 1.3)], -1)


def rolling(readouts, seed=0, path=round_path):
    """Of a run whose cameras read their rows one after the other, in so many s."""
    rng = np.random.default_rng(seed)
    cameras, b, shares = thesis_rig(len(readouts)), [], []
    for camera, seconds in zip(cameras, readouts, strict=True):
        at = AT
        for _ in range(12):
            at = AT + seconds * (project(camera, path(at))[:, 1] + 0.5) / camera.image_size[1]
        b.append(project(camera, path(at)) + rng.normal(0, NOISE, (AT.size, 2)))
        shares.append((b[-1][:, 1] + 0.5) / camera.image_size[1])
    b, shares = np.stack(b)[:, None], np.stack(shares)[:, None]
    sd = np.full(b.shape, NOISE)
    located = locate_points(cameras, b, sd=sd)
    return sight_misses(cameras, [None] * len(readouts), None, located, b, sd, AT, shares)


@pytest.mark.parametrize("readouts", [(0.0, 0.0, 0.0), (0.016, 0.016, 0.016), (0.03, 0.0, 0.01), (0.0, -0.02, 0.0)])
def test_read_outs_are_estimated_from_the_motion_within_their_standard_errors(readouts):
    found = np.array([rolling(readouts, seed).readout for seed in range(4)])
    z = (found[..., 0] - readouts) / found[..., 1]
    assert np.abs(z).max() < 4
    assert (found[..., 1] < 0.004).all()


def test_no_read_out_is_estimated_without_the_rows():
    found, _ = misses(2)
    assert np.isnan(found.readout).all()


def test_delays_are_estimated_behind_the_first_camera_within_their_standard_errors():
    for seed in range(4):
        late = misses(3, late=0.002, seed=seed)[0].late
        assert late[0].tolist() == [0, 0]
        assert late[1:, 0] == pytest.approx([0.002, 0], abs=4 * late[1:, 1].max())
        assert late[1:, 1].max() < 2e-4


def test_a_target_that_moves_along_the_epipolar_lines_shows_no_delay():
    """Two cameras beside each other see a motion along their base line move along these lines."""
    a, b = (camera.position for camera in thesis_rig(2))
    along = (b - a) / np.linalg.norm(b - a)
    found, _ = misses(2, path=lambda t: 10 * np.sin(2 * np.pi * t / 1.6)[:, None] * along)
    assert found.late[1, 1] * found.speed > 5 * NOISE


def missing(*, sd, lasting=0.0, n=3):
    """Positions of a rig that sees with NOISE px and claims sd px; how far off they are, over sigma; and its misses."""
    rng, cameras = np.random.default_rng(8), thesis_rig(n)
    b = np.stack([project(c, pluck(AT)) + rng.normal(0, NOISE, (AT.size, 2)) for c in cameras])[:, None]
    b[0, ..., 0] += lasting
    b[1, ..., 1] -= lasting
    given = np.full(b.shape, sd)
    located = locate_points(cameras, b, sd=given)
    return located, sight_misses(cameras, [None] * n, None, located, b, given, AT)


def over(located):
    return float(np.sqrt((((located.point[0] - pluck(AT)) / located.sigma[0]) ** 2).mean()))


def test_sigma_holds_what_lines_of_sight_miss_by_all_along_the_run():
    located, found = missing(sd=NOISE / 2)
    assert over(located) == pytest.approx(2, rel=0.1)
    grown, growth = with_misses(located, located, found)
    assert growth == pytest.approx(found.beyond)
    assert over(grown) == pytest.approx(1, rel=0.1)
    assert np.sqrt(np.diagonal(grown.covariance, axis1=-2, axis2=-1)) == pytest.approx(grown.sigma)
    off = missing(sd=NOISE, lasting=0.2)
    assert over(off[0]) > 1.7
    assert over(with_misses(off[0], *off)[0]) < 1.3


def test_sigma_that_holds_them_already_stays():
    located, found = missing(sd=NOISE * 1.2)
    assert with_misses(located, located, found) == (located, 1.0)
    assert with_misses(located, located, None) == (located, 1.0)
    small, found = missing(sd=NOISE / 2)
    large = small._replace(sigma=3 * small.sigma, covariance=9 * small.covariance)
    assert with_misses(large, small, found)[0].sigma == pytest.approx(large.sigma)


def test_positions_that_are_not_known_stay_so():
    located, found = missing(sd=NOISE / 2)
    sigma = located.sigma.copy()
    sigma[0, 3] = np.nan
    grown, _ = with_misses(located._replace(sigma=sigma), located, found)
    assert np.isnan(grown.sigma[0, 3]).all()
    assert np.isfinite(grown.sigma[0, 4:]).all()

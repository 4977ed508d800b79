"""Of the causes why lines of sight miss, the one that is at work is found, with its amount."""

import numpy as np
import pytest

from tests.location.sight_lines.test_sight_misses import AT, NOISE, misses, pluck
from vidtrack.geometry.camera import project
from vidtrack.geometry.triangulate import locate_points
from vidtrack.location.sight_lines import sight_causes as module
from vidtrack.location.sight_lines.sight_causes import KNOWN_SDS, SURELY, Cause, causes, least_moved, likeliest
from vidtrack.location.sight_lines.sight_system import calibration_of, sight_system
from vidtrack.simulate.rig import thesis_rig


def along(t):
    """A swing along the base line of two cameras, so that a delay hardly shows in the misses and moves much."""
    return np.stack([24 * np.cos(2 * np.pi * t / 1.6), 0.2 * np.sin(5 * t), 0.5 * np.sin(2 * np.pi * t / 0.9)], -1)


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("rate", [0.002, -0.002])
def test_a_clock_that_runs_fast_is_named_with_its_rate(n, rate):
    found, over = misses(n, late=rate * AT, path=along)
    assert found.cause.kind == "fast"
    assert 1 in found.cause.cameras
    assert abs(found.cause.amount) == pytest.approx(2000, abs=3 * found.cause.sd + 60)
    assert found.cause.evidence > 20
    assert found.cause.share > 0.9
    assert found.cause.moved == pytest.approx(over, rel=0.25)


def test_a_clock_that_jumps_in_the_run_is_named_with_its_moment():
    found, over = misses(3, late=0.033 * (AT > 4.0))
    assert (found.cause.kind, found.cause.cameras) == ("jumped", (1,))
    assert found.cause.amount == pytest.approx(0.033, rel=0.05)
    assert found.cause.from_s == pytest.approx(4.0, abs=0.6)
    assert found.cause.moved == pytest.approx(over, rel=0.2)


def test_a_clock_that_is_late_neither_runs_nor_jumps():
    found, _ = misses(2, late=0.004, path=along)
    assert found.cause.kind == "late"
    assert found.cause.evidence > 20


def test_of_causes_that_explain_as_much_the_evident_one_is_preferred():
    turned = Cause("turned", (0,), 1.2, 0.4, 1.0, 1.2, 90.0)
    fast = Cause("fast", (1,), 5000.0, 90.0, 0.95, 40.0, 17.0)
    assert likeliest([turned, fast]).kind == "fast"
    assert likeliest([turned, fast._replace(share=0.5)]).kind == "turned"


def test_a_turn_by_more_than_a_camera_can_turn_unseen_is_no_cause_where_a_clock_is_one():
    turned = Cause("turned", (0,), 68.0, 2.0, 1.0, 900.0, 1e4)
    late = Cause("late", (1,), 0.095, 0.003, 0.9, 700.0, 80.0)
    assert likeliest([turned, late]) == late
    assert likeliest([turned._replace(amount=1.3), late]).kind == "turned"
    assert likeliest([turned]).kind == "turned"


def test_a_zoom_by_a_third_that_leaves_a_pixel_is_a_turned_camera():
    zoomed = Cause("all zoomed", (0, 1), 0.3153, 0.0085, 0.95, 900.0, 18.0)
    turned = Cause("turned", (0,), 1.2, 0.4, 0.9, 850.0, 16.0)
    assert likeliest([zoomed, turned]).kind == "turned"
    assert likeliest([zoomed._replace(amount=0.04), turned]).kind == "all zoomed"


@pytest.mark.parametrize(("kind", "spoiled"), [("turned", {"roll": 1.0}), ("late", {"late": 0.01})])
def test_amounts_scatter_as_their_standard_deviations_say(kind, spoiled):
    found = [misses(3, seed=seed, **spoiled)[0].cause for seed in range(8)]
    assert {cause.kind for cause in found} == {kind}
    z = [(abs(cause.amount) - next(iter(spoiled.values()))) / cause.sd for cause in found]
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 2


def every_cause(b, *, noise=NOISE, path=pluck):
    """All causes of exact cameras that see a path at AT at pixels b (n_cameras, T, 2), best first."""
    cameras, b = thesis_rig(len(b)), b[:, None]
    sd = np.full(b.shape, noise)
    located, every, moments = locate_points(cameras, b, sd=sd), np.zeros(AT.size, np.intp), np.arange(AT.size)
    p = located.point[0]
    system = sight_system(cameras, p, located, every, moments, np.ones((len(b), AT.size), bool), sd)
    known = calibration_of(cameras, [None] * len(b), None, p, system)
    return causes(cameras, system, p, np.gradient(b[:, 0], AT, axis=1), AT, *known)


def seen(n, noise=NOISE, path=pluck):
    rng = np.random.default_rng(5)
    return np.stack([project(camera, path(AT)) for camera in thesis_rig(n)]) + rng.normal(0, noise, (n, AT.size, 2))


def test_a_clock_may_jump_between_any_two_eighths_of_the_run():
    moments = {cause.from_s for cause in every_cause(seen(2)) if cause.kind == "jumped"}
    assert sorted(moments) == pytest.approx(np.linspace(AT[0], AT[-1], 9)[1:-1])


def test_an_error_of_the_pixels_that_varies_linearly_over_the_scene_is_no_evidence_for_a_clock():
    """What a lens model leaves: 0.1 px from one side of the scene to the other, twenty times the noise."""
    noise, path = 0.005, pluck(AT)
    b = seen(3, noise)
    b[1] += 0.05 * (path[:, [0]] / np.abs(path[:, 0]).max() + [1.0, -0.5])
    clocks = [cause for cause in every_cause(b, noise=noise) if cause.kind in ("late", "fast")]
    assert max(cause.evidence for cause in clocks) < 9
    b = seen(3, noise)
    b[1] += 0.002 * np.gradient(b[1], AT, axis=0)
    assert max(cause.evidence for cause in every_cause(b, noise=noise) if cause.kind == "late") > 100


@pytest.mark.parametrize("kind", ["late", "turned"])
def test_evidence_grows_little_once_noise_is_below_what_does_not_average_away(kind):
    """A tenth of the noise would make a hundred times the evidence of errors that are independent."""
    evidence = []
    for noise in (0.02, 0.002):
        b = seen(3, noise)
        b[1] += 0.003 * np.gradient(b[1], AT, axis=0) if kind == "late" else [0.3, 0.2]
        (cause,) = [c for c in every_cause(b, noise=noise) if c.kind == kind and c.cameras == (1,)]
        evidence.append(cause.evidence)
    assert 9 < evidence[1] < 5 * evidence[0]


@pytest.mark.parametrize("seed", range(6))
def test_the_least_that_a_cause_moves_is_that_of_the_best_of_all_amounts_within_its_deviations(seed):
    rng = np.random.default_rng(seed)
    k = 1 + 2 * (seed % 2)
    A, B = rng.normal(size=(2, k, k))
    covariance, M = A @ A.T + 0.01 * np.eye(k), B @ B.T
    x = rng.normal(size=k) * 6
    way = rng.normal(size=(200_000, k))
    way *= SURELY / np.linalg.norm(way, axis=1)[:, None]
    amounts = x + way @ np.linalg.cholesky(covariance).T
    tried = np.sqrt(np.einsum("nj,jk,nk->n", amounts, M, amounts)).min()
    inside = x @ np.linalg.solve(covariance, x) < SURELY**2
    assert least_moved(x, covariance, M) == pytest.approx(0.0 if inside else tried, rel=0.05, abs=0.02)


def test_a_turn_about_the_line_to_the_targets_is_not_judged_by_what_is_not_known_of_it(monkeypatch):
    """Targets in one small place show two of the three ways to turn."""

    def small(t):
        return np.array([6.0, 3.0, -4.0]) + 0.02 * pluck(t)

    found, over = misses(3, aside=0.15, seed=1, path=small)
    cause = found.cause
    assert cause.kind == "turned"
    assert cause.evidence > 9
    assert cause.amount < KNOWN_SDS * cause.sd
    assert 0.3 * over < cause.moved < over
    monkeypatch.setattr(module, "least_moved", lambda *_: 48.0)
    assert misses(3, aside=0.15, seed=1, path=small)[0].cause.moved == 48.0
    assert misses(3, roll=1.3)[0].cause.moved < 48.0, "what is well known counts as it is"

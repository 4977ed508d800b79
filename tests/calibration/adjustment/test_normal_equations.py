"""Several families of blocks eliminated: the whole system, solved densely, is the independent source."""

import numpy as np
import pytest

from vidtrack.calibration.adjustment import normal_equations
from vidtrack.calibration.adjustment.normal_equations import Equations, Prior, covariance, solved, summed


def _case(seed):
    """5 shared parameters; points (3 unknowns) and poses (6); one measurement is missing, one coordinate held."""
    rng = np.random.default_rng(seed)
    sizes = [(7, 3), (4, 6)]
    equations = []
    for family, (n, d) in enumerate(sizes):
        for columns in ([0, 1, 2], [2, 3, 4], [1, 4]):
            q = 5
            weight = rng.uniform(0.5, 2, (n, q))
            weight[1, 2] = 0
            residual = rng.normal(0, 1, (n, q))
            residual[1, 2] = np.nan
            by_shared, by_block = rng.normal(0, 1, (n, q, len(columns))), rng.normal(0, 1, (n, q, d))
            equations.append(Equations(residual, weight, np.array(columns), by_shared, family, by_block))
    equations.append(Equations(rng.normal(0, 1, (1, 2)), np.ones((1, 2)), np.array([0, 3]), np.eye(2)[None]))
    information = [np.full(size, 0.5) for size in sizes]
    information[0][2, 1] = np.inf
    priors = [Prior(i, rng.normal(0, 1, i.shape)) for i in information]
    return equations, priors, sizes


def _dense(equations, priors, sizes):
    starts = [5, 5 + 21]
    size = 5 + 21 + 24
    rows, right = [], []
    for each in equations:
        for a in range(len(each.residual)):
            for k in range(each.residual.shape[1]):
                if each.weight[a, k] > 0:
                    row = np.zeros(size)
                    row[each.columns] = each.by_shared[a, k]
                    if each.family is not None:
                        d = sizes[each.family][1]
                        at = starts[each.family] + a * d
                        row[at : at + d] = each.by_block[a, k]
                    rows.append(row * np.sqrt(each.weight[a, k]))
                    right.append(each.residual[a, k] * np.sqrt(each.weight[a, k]))
    for start, prior in zip(starts, priors, strict=True):
        for k, (i, s) in enumerate(zip(prior.information.ravel(), prior.shift.ravel(), strict=True)):
            row = np.zeros(size)
            row[start + k] = 1e7 if np.isinf(i) else np.sqrt(i)  # held: as good as known without error
            rows.append(row)
            right.append(0.0 if np.isinf(i) else s * np.sqrt(i))
    return np.array(rows), np.array(right)


@pytest.mark.parametrize("seed", range(4))
def test_eliminating_several_families_changes_nothing(seed):
    equations, priors, sizes = _case(seed)
    normal = summed(equations, 5, priors)
    shared, blocks = solved(normal)
    A, right = _dense(equations, priors, sizes)
    whole = np.linalg.lstsq(A, right, rcond=None)[0]
    np.testing.assert_allclose(np.concatenate([shared, *(b.ravel() for b in blocks)]), whole, atol=1e-7)
    known = covariance(normal, equations, priors)
    np.testing.assert_allclose(known.shared, covariance(normal, equations).shared, rtol=1e-9)
    C = np.linalg.inv(A.T @ A)
    np.testing.assert_allclose(known.shared, C[:5, :5], atol=1e-9)
    np.testing.assert_allclose(known.blocks[0][3], C[5 + 9 : 5 + 12, 5 + 9 : 5 + 12], atol=1e-9)
    np.testing.assert_allclose(known.blocks[1][2], C[26 + 12 : 26 + 18, 26 + 12 : 26 + 18], atol=1e-9)
    # weighted variances of what is computed: row by row those of the dense projection
    fitted = ((A @ C) * A).sum(1)
    ours = np.concatenate([(f * e.weight)[e.weight > 0] for f, e in zip(known.fitted, equations, strict=True)])
    np.testing.assert_allclose(ours, fitted[: len(ours)], atol=1e-7)


@pytest.mark.parametrize("at_once", [1, 10**9])
@pytest.mark.parametrize("seed", range(3))
def test_what_blocks_take_up_leaves_the_covariance_its_digits(seed, at_once, monkeypatch):
    """Nearly all that the shared parameters do, some step of the blocks does too, as where a survey is rough."""
    monkeypatch.setattr(normal_equations, "AT_ONCE", at_once)
    equations, priors, sizes = _case(seed)
    rng = np.random.default_rng(seed)
    follow = [rng.normal(0, 1, (n, d, 5)) for n, d in sizes]
    held = np.isinf(priors[0].information)
    follow[0][held] = 0
    for k, each in enumerate(equations[:-1]):
        by_shared = 1e-6 * rng.normal(size=(*each.weight.shape, 5)) + each.by_block @ follow[each.family]
        equations[k] = each._replace(by_shared=by_shared, columns=np.arange(5))
    equations[-1] = equations[-1]._replace(by_shared=1e-6 * equations[-1].by_shared)
    priors = [p._replace(information=np.where(np.isinf(p.information), np.inf, 1e-12)) for p in priors]
    A, _ = _dense(equations, priors, sizes)
    r = np.linalg.inv(np.linalg.qr(A, mode="r"))
    wanted = (r @ r.T)[:5, :5]
    found = covariance(summed(equations, 5, priors), equations, priors).shared
    np.testing.assert_allclose(found, wanted, rtol=1e-7, atol=1e-9 * np.abs(wanted).max())


def test_a_damped_step_is_shorter_and_points_downhill():
    equations, priors, _ = _case(0)
    normal = summed(equations, 5, priors)
    free, damped = solved(normal)[0], solved(normal, 10.0)[0]
    assert np.linalg.norm(damped) < np.linalg.norm(free)
    assert damped @ normal.g > 0


def test_a_parameter_of_which_nothing_is_measured_is_refused():
    equations, priors, _ = _case(0)
    with pytest.raises(ValueError, match="open"):
        covariance(summed(equations, 6, priors), equations)
    with pytest.raises(ValueError, match="open"):
        covariance(summed(equations, 6, priors), equations, priors)

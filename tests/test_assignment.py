from itertools import permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.assignment import mutual_best, one_to_one, one_to_one_within


def test_the_nearest_first_would_cost_more():
    cost = np.array([[1.0, 2.0], [1.5, 9.0]])
    assert one_to_one(cost).tolist() == [1, 0]


def test_what_cannot_be_is_not_and_nobody_shares():
    cost = np.array([[1.0, np.inf], [2.0, np.inf], [np.inf, np.inf]])
    assert one_to_one(cost).tolist() == [0, -1, -1]
    assert one_to_one(np.zeros((2, 0))).tolist() == [-1, -1]
    assert mutual_best(cost).tolist() == [0, -1, -1]


@given(st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_no_other_way_joins_more_or_costs_less(seed):
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 1, (3, 4))
    cost[rng.random((3, 4)) < 0.4] = np.inf

    def worth(columns):
        values = [cost[i, j] for i, j in enumerate(columns) if j >= 0 and np.isfinite(cost[i, j])]
        return len(values), -sum(values)

    best = max(worth(p) for p in permutations(range(4), 3))
    chosen = one_to_one(cost)
    assert worth(chosen)[0] == best[0]
    assert np.isclose(worth(chosen)[1], best[1])
    taken = chosen[chosen >= 0]
    assert len(set(taken)) == len(taken)
    greedy = mutual_best(cost)
    taken = greedy[greedy >= 0]
    assert len(set(taken)) == len(taken)
    assert np.isfinite(cost[np.flatnonzero(greedy >= 0), taken]).all()


def test_no_pair_costs_more_than_going_without():
    cost = np.array([[1.0, 4.0], [1.5, 9.0], [np.inf, 6.0]])
    assert one_to_one_within(cost, 5.0).tolist() == [1, 0, -1]  # 4 + 1.5 + 5 is less than 1 + 5 + 5
    assert one_to_one_within(cost, 4.0).tolist() == [0, -1, -1]
    assert one_to_one_within(np.zeros((2, 0)), 1.0).tolist() == [-1, -1]


@given(st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_within_a_limit_no_other_way_costs_less(seed):
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 1, (3, 4))

    def worth(columns):
        return sum(min(cost[i, j], 0.6) if j >= 0 else 0.6 for i, j in enumerate(columns))

    chosen = one_to_one_within(cost, 0.6)
    assert np.isclose(worth(chosen), min(worth(p) for p in permutations(range(4), 3)))
    assert (cost[np.flatnonzero(chosen >= 0), chosen[chosen >= 0]] < 0.6).all()

"""How many samples are measured at once: more while all goes well, one where something is sought or begun."""

import numpy as np
import pytest

from tests.tracking.test_tracker import circle, followed, samples_of, starts_at
from vidtrack.tracking.centroiding.dispatch import measure_targets
from vidtrack.tracking.pace import PACE, Pacer, sought_now
from vidtrack.tracking.state import Appearance

SEEN, NONE, LATE = np.zeros(2, np.intp), np.zeros(2, bool), np.full(2, -5)


def settled():
    """A pacer with small targets that has gone well for long."""
    pacer = Pacer()
    pacer.windows(looking(8.0), templates=True)
    for _ in range(20):
        pacer.went(1, well=True)
    return pacer


def looking(size, soft=1.0):
    """Two targets, size px wide and high."""
    values = np.full((8, 2), 20.0)
    values[3:5], values[5] = size, soft
    return Appearance(values)


def test_each_step_that_goes_well_adds_a_sample_up_to_the_most():
    pacer, counts = Pacer(), []
    for _ in range(12):
        counts.append(pacer.samples(SEEN, NONE, LATE))
        pacer.went(counts[-1], well=True)
    assert counts[0] == 1
    assert max(counts) <= PACE.samples_at_once
    assert (np.diff(counts) >= 0).all()


def test_after_a_step_that_did_not_the_next_takes_as_many_as_were_taken():
    pacer = settled()
    assert pacer.samples(SEEN, NONE, LATE) == PACE.samples_at_once
    pacer.went(3, well=False)
    assert pacer.samples(SEEN, NONE, LATE) == 3


@pytest.mark.parametrize(("missing", "samples"), [(1, 1), (9, 1), (10, 6), (15, 1), (16, 8), (21, 3)])
def test_a_step_ends_at_the_sample_in_which_a_lost_target_is_sought_next(missing, samples):
    assert settled().samples(np.array([0, missing]), NONE, LATE) == samples


def test_in_an_occlusion_every_sample_is_taken_by_itself():
    assert settled().samples(np.array([0, 20]), np.array([False, True]), LATE) == 1


def test_a_step_ends_where_a_target_begins():
    assert settled().samples(np.array([0, -1]), NONE, np.array([-5, 3])) == 3
    assert settled().samples(np.array([0, -1]), NONE, np.array([2, 0])) == 1  # that of a target that has begun is past


def test_lost_targets_are_sought_in_each_sample_at_first_and_then_in_every_eighth():
    missing = np.array([0, -1, 1, 10, 11, 16, 17, 11])
    assert sought_now(missing, np.arange(8) == 7).tolist() == [2, 3, 5, 7]


@pytest.mark.parametrize(("soft", "templates", "samples"), [(1.0, True, 8), (1.0, False, 5), (np.nan, True, 5)])
def test_large_windows_let_fewer_samples_in_and_templates_need_less_than_segmentation(soft, templates, samples):
    pacer = settled()
    pacer.windows(looking(100.0, soft), templates=templates)
    assert pacer.samples(SEEN, NONE, LATE) == samples


def test_the_unrest_of_the_background_is_measured_in_every_fourth_reading(monkeypatch):
    path = circle(60, 2)
    careful = []

    def measured(*given, **known):
        careful.append(known["careful"])
        return measure_targets(*given, **known)

    monkeypatch.setattr("vidtrack.tracking.tracker.measure_targets", measured)
    followed(samples_of(path), starts_at(path[0]))
    assert len(careful) > 8
    assert [k for k, now in enumerate(careful) if now] == list(range(3, len(careful), 4))

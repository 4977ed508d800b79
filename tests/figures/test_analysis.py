"""Figures of decay and waves, drawn from the stage's own record."""

import numpy as np
import pandas as pd

from tests.stages.test_analysis import AXES, body_in_waves, swinging, trajectory
from vidtrack.figures.analysis import free_decay, mean_cycle, transfer_functions
from vidtrack.files.records import plain
from vidtrack.stages.analysis import analysis


def test_the_decay_shows_data_and_fit_residual_and_decrement():
    record = plain(analysis(swinging(np.random.default_rng(0)), decay={}, units="in").record)["decay"]
    figure = free_decay(record, "pluck")
    data, residual, decrement = figure.axes
    assert len(data.lines[0].x) == len(record["fit"]["time_s"])
    assert np.abs(residual.lines[0].y).max() < 0.05
    assert "(in)" in decrement.xlabel


def test_a_regular_wave_shows_its_mean_cycle():
    bodies, gauge = body_in_waves(np.random.default_rng(1))
    nothing = swinging(np.random.default_rng(2)).iloc[:0]
    record = plain(analysis(nothing, bodies, gauge, axes=AXES, waves={"elevation": "eta"}).record)["waves"]
    wave, heave = mean_cycle(record, ["float.heave"], "in", "regular").axes
    assert abs(np.max(wave.lines[0].y) - 1.5) < 0.02
    assert abs(np.max(heave.lines[0].y) - 2.0) < 0.02


def test_a_transfer_function_shows_only_what_is_coherent():
    rng = np.random.default_rng(3)
    t = np.arange(0, 300, 1 / 20)
    f, phase = rng.normal(0.4, 0.08, 100), rng.uniform(0, 2 * np.pi, 100)
    angle = 2 * np.pi * np.outer(t, f) + phase
    gauge = pd.DataFrame({"time_s": t, "eta": np.cos(angle).sum(axis=1)})
    table = trajectory({"z": np.cos(angle - 0.5).sum(axis=1)}, t, rng, noise=0.2)
    record = plain(analysis(table, None, gauge, waves={"elevation": "eta"}).record)["waves"]
    ratio, _, coherence = transfer_functions(record, ["t1.z"], "in", "irregular").axes
    assert np.isnan(ratio.lines[0].y).any()
    assert coherence.ylim == (0, 1.02)

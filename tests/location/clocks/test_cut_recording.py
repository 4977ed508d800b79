"""A recording from whose middle a part is missing while its time goes on is named, with what is missing."""

import numpy as np
import pytest

from tests.stages.test_locate import centroids, pluck
from vidtrack.association.tracklets import COLUMNS
from vidtrack.simulate.rig import thesis_rig
from vidtrack.stages.locate import locate

CUT_AT, RATE = 100, 30.0


def run(n, missing, noise=0.05):
    """Findings of a run of n cameras, the first of which misses so many pictures from CUT_AT on."""
    rng = np.random.default_rng(8)
    cameras = thesis_rig(n)
    tables = {c.name: centroids(c, {"t1": pluck}, rng=rng, noise=noise, rate_hz=RATE) for c in cameras}
    own = tables["cam1"]
    for name in ("Xf", "Yf"):
        own[name] = np.where(own.index >= CUT_AT, own[name].shift(-missing), own[name])
    tables["cam1"] = own = own.iloc[: len(own) - missing].copy()
    pieces = own.assign(tracklet=(own.index >= CUT_AT).astype(int)).reindex(columns=list(COLUMNS))
    located = locate(tables, {c.name: (c, None) for c in cameras}, targets=1, tracklets={"cam1": pieces})
    return [f for f in located.record["findings"] if f["code"] == "recording-cut"]


@pytest.mark.parametrize(("n", "level"), [(2, "bad"), (3, "doubtful")])
@pytest.mark.parametrize("missing", [9, 15, 40])
def test_the_camera_and_what_it_misses_are_named(n, level, missing):
    (finding,) = run(n, missing)
    assert finding["level"] == level
    assert finding["text"].startswith(f"cam1: from 10:00:03.3 on its recording is {missing / RATE:.3g} s ahead")


@pytest.mark.parametrize("n", [2, 3])
def test_a_whole_recording_whose_track_is_in_pieces_is_not_cut(n):
    assert not run(n, 0)

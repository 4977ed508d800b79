"""A read-out that is sought: the run is located again until the lines of sight show no more of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from vidtrack.location.clocks.readout_search import SETTINGS, sought_readouts
from vidtrack.timing.readout import Readout

SIZE = (640, 480)


def runs(true, sd=0.0005, share=0.9):
    """A locating that shows `share` of what is missing of each read-out, s; and the read-outs that it was given."""
    given = []

    def locate(now):
        given.append({camera: readout.seconds for camera, readout in now.items()})
        left = {camera: share * (seconds - now[camera].seconds) for camera, seconds in true.items()}
        lines = {"readout_s": left, "readout_sd_s": dict.fromkeys(true, sd)}
        return SimpleNamespace(record={"sight_lines": lines})

    return locate, given


def start(*cameras):
    return {camera: Readout(0.0, SIZE) for camera in cameras}


def test_a_read_out_is_approached_in_few_rounds_and_the_others_stay():
    locate, given = runs({"a": 0.03})
    found = sought_readouts(locate, start("a", "b"), ["a"], "run")
    assert found.readouts["a"].seconds == pytest.approx(0.03, abs=SETTINGS.same_s)
    assert found.readouts["b"].seconds == 0.0
    assert found.sd == {"a": 0.0005}
    assert found.findings == []
    assert len(given) == SETTINGS.rounds + 1
    assert found.as_record() == {"a": {"seconds": found.readouts["a"].seconds, "sd": 0.0005}}


def test_the_last_locating_is_the_one_with_the_read_outs_that_are_returned():
    locate, given = runs({"a": 0.03}, share=1.0)
    found = sought_readouts(locate, start("a"), ["a"], "run")
    assert given[-1]["a"] == found.readouts["a"].seconds
    assert len(given) == 2  # nothing was missing then


def test_a_read_out_within_three_standard_errors_of_none_is_none():
    locate, _ = runs({"a": 0.001}, sd=0.0005)
    found = sought_readouts(locate, {"a": Readout(0.0008, SIZE)}, ["a"], "run")
    assert found.readouts["a"].seconds == 0.0


@pytest.mark.parametrize(("sd", "how"), [(0.005, "only to 5 ms"), (None, "not at all")])
def test_a_read_out_that_the_motion_hardly_shows_is_a_doubt_with_its_camera(sd, how):
    locate, _ = runs({"a": 0.03}, sd=sd)
    found = sought_readouts(locate, start("a"), ["a"], "runs.pluck")
    (finding,) = found.findings
    assert (finding.level, finding.code) == ("doubtful", "readout-unsure")
    assert finding.text == f"runs.pluck: a: the motion shows the read-out of its rows {how}"
    assert "cameras.a.readout_ms" in finding.cure


def test_a_locating_without_lines_of_sight_leaves_the_read_out_as_it_was_and_says_so():
    found = sought_readouts(lambda now: SimpleNamespace(record={}), start("a"), ["a"], "run")
    assert found.readouts["a"].seconds == 0.0
    assert np.isnan(found.sd["a"])
    assert [finding.code for finding in found.findings] == ["readout-unsure"]

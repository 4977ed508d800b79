"""Which targets of a file are used, and by which clock, where file and config.yaml both may say it."""

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.tracks.configured import chosen, clock_of
from vidtrack.exchange.tracks.digitised import Digitised


def tracks(**more):
    return Digitised("x", ("a", "b", "c"), np.arange(4), np.arange(24.0).reshape(4, 3, 2), True, **more)


def test_targets_are_those_that_the_config_names_in_its_order():
    own = chosen(tracks(), ["c", "a"], "runs.r")
    assert own.names == ("c", "a")
    np.testing.assert_array_equal(own.b, tracks().b[:, [2, 0]])
    assert chosen(tracks(), None, "runs.r").names == ("a", "b", "c")


def test_a_name_that_the_file_does_not_have_is_refused_with_those_that_it_has():
    with pytest.raises(VidtrackError, match=r"runs\.r\.targets: no d among the tracks; there are a, b, c\."):
        chosen(tracks(), ["a", "d"], "runs.r")


def test_the_rate_of_the_config_counts_before_that_of_the_file():
    assert clock_of(tracks(rate=60.0), 50.0, None, "runs.r").rate == 50
    assert clock_of(tracks(rate=60.0), None, None, "runs.r").rate == 60


def test_the_code_of_the_file_counts_before_that_of_the_config():
    own = clock_of(tracks(code=("10:00:00:15",)), 60.0, "09:00:00:00", "runs.r")
    assert own.source == "file"
    assert str(own.first) == "10:00:00:15"
    configured = clock_of(tracks(), 60.0, "09:00:00:00", "runs.r")
    assert (configured.source, str(configured.first)) == ("config", "09:00:00:00")


def test_cameras_digitised_together_share_the_clock_of_their_rows():
    assert clock_of(tracks(together=True), 60.0, None, "runs.r").source == "rows"


def test_a_code_that_is_none_is_refused_by_its_key():
    with pytest.raises(VidtrackError, match=r"^config.yaml: runs\.r\.start_timecode: "):
        clock_of(tracks(), 60.0, "ten", "runs.r")

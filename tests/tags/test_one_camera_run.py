"""The record of a run that one camera sees by its tags alone."""

from vidtrack.location.cameras.run_sights import sight_columns
from vidtrack.tags.one_camera_run import no_sights, record_of


def test_the_clock_that_the_config_gives_is_recorded_and_is_the_config_s():
    record = record_of("cam1", {"offset_s": 0.5}, "mm", 40, 38)
    assert record["clocks"]["cameras"] == {"cam1": {"offset_s": 0.5, "rate_ppm": 0.0, "source": "config"}}
    assert record["samples"] == {"total": 40, "located": 38}
    assert record["units"] == "mm"


def test_no_lines_of_sight_meet():
    assert all(len(column) == 0 for column in sight_columns(no_sights("cam1")).values())

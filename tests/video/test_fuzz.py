import pytest

from benchmarks.fuzz import KINDS, tried

SEEDS = range(15)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mutated_recording_is_read_or_refused_in_one_line(tmp_path, kind):
    assert set(tried(tmp_path, kind, SEEDS)) <= {"read", "refused"}

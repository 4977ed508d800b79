import pytest

from benchmarks.fuzz.reader import tried
from benchmarks.fuzz.recordings import READERS

SEEDS = range(4)


@pytest.mark.parametrize("kind", READERS)
def test_a_mutated_recording_is_read_or_refused_in_one_line(tmp_path, kind):
    assert set(tried(tmp_path, kind, READERS[kind], SEEDS)) <= {"read", "refused"}

import pytest

from benchmarks.fuzz.programs import READERS
from benchmarks.fuzz.reader import tried

SEEDS = range(4)


@pytest.mark.parametrize("kind", READERS)
def test_a_mutated_file_of_another_program_is_read_or_refused_in_clear_lines(tmp_path, kind):
    assert set(tried(tmp_path, kind, READERS[kind], SEEDS)) <= {"read", "refused"}

import pytest

from benchmarks.fuzz.reader import tried
from benchmarks.fuzz.tables import READERS

SEEDS = range(4)


@pytest.mark.parametrize("kind", [kind for kind in READERS if kind != "daq.mat"])
def test_a_mutated_table_config_or_record_is_read_or_refused_in_clear_lines(tmp_path, kind):
    if kind.endswith("tdms"):
        pytest.importorskip("nptdms")
    assert set(tried(tmp_path, kind, READERS[kind], SEEDS)) <= {"read", "refused"}


def test_a_mat_file_that_kills_its_library_is_refused_in_one_line(tmp_path):
    """Seeds that ended scipy's reader in a segmentation fault."""
    seeds = [640, 596, 5472]
    for seed in seeds:
        assert set(tried(tmp_path, "daq.mat", READERS["daq.mat"], range(seed, seed + 1))) <= {"read", "refused"}

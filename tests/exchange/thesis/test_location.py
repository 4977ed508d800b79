import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.location import read_location, write_location

HEAD = (
    "pluck\nlocation.prn\n10:00:00\n10/21/92\nThis file\ntargets location\n\n\n Time1 Time2 X Y Z\n" + "=" * 70 + "\n"
)


def test_rows_that_locate_repeated_are_left_out(tmp_path):
    path = tmp_path / "location.prn"
    rows = [
        "10:00:55:00\t10:00:55:00\t    10.00     20.00     30.00",
        "10:00:55:01\t10:00:55:01\t    10.50     20.00     30.00",
        "10:00:55:02\t10:00:55:01\t    11.00     20.00     30.00",  # camera 2's file has ended
        "10:00:55:02\t10:00:55:01\t    11.00     20.00     30.00",  # after the last line end
    ]
    path.write_text(HEAD + "\n".join(rows) + "\n")
    found = read_location(path)
    assert found.first == ("10:00:55:00", "10:00:55:01")
    assert found.p.tolist() == [[10, 20, 30], [10.5, 20, 30]]
    assert found.repeated == 2


def test_positions_that_are_written_are_read_to_two_decimals(tmp_path):
    path = tmp_path / "location.prn"
    p = np.round(np.random.default_rng(0).uniform(-500, 500, (20, 3)), 2)
    codes = [f"10:00:55:{k:02d}" for k in range(20)]
    p[7] = np.nan
    write_location(path, (codes, codes), p, "a run")
    found = read_location(path)
    assert len(found.p) == 19
    assert found.repeated == 0
    np.testing.assert_allclose(found.p, np.delete(p, 7, 0), atol=1e-9)
    assert found.first == tuple(np.delete(codes, 7))


def test_a_row_without_a_time_code_is_refused(tmp_path):
    path = tmp_path / "location.prn"
    path.write_text(HEAD + "10:00:55:00\t10:00:55:00\t 1.0\n")
    with pytest.raises(VidtrackError, match="line 11: not `time1 time2 x y z`"):
        read_location(path)

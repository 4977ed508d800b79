import numpy as np
import pytest

from tests.exchange.points.test_c3d import positions, written
from tests.exchange.points.test_qtm import markers
from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.formats import read_measured


def test_the_ending_says_what_a_file_is(tmp_path):
    written(tmp_path / "truth.c3d", positions()).rename(tmp_path / "truth.C3D")
    np.testing.assert_array_equal(read_measured(tmp_path / "truth.C3D").p, positions())
    (tmp_path / "truth.tsv").write_text(markers())
    assert read_measured(tmp_path / "truth.tsv").format == "QTM"
    with pytest.raises(VidtrackError, match=r"\.c3d, \.tsv, \.mat and CSV"):
        read_measured(tmp_path / "truth.xls")

import io

import numpy as np
import pandas as pd
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.points.qtm import read

HEAD = (
    "NO_OF_FRAMES\t{k}\nNO_OF_CAMERAS\t4\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nNO_OF_ANALOG\t0\nANALOG_FREQUENCY\t0\n"
    "DESCRIPTION\t--\nTIME_STAMP\t2020-01-22, 17:47:17.250\t22107.99\nDATA_INCLUDED\t{kind}\n{names}"
)


def markers(k=20, columns=True, before=True) -> str:
    p = np.round(np.random.default_rng(0).uniform(-900, 900, (k, 2, 3)), 3)
    p[3, 1] = 0
    text = HEAD.format(k=k, kind="3D", names="MARKER_NAMES\tbow\tstern é\n")
    if columns:
        text += "Frame\tTime\t" * before + "bow X\tbow Y\tbow Z\tstern é X\tstern é Y\tstern é Z\n"
    for i, row in enumerate(p.reshape(k, 6)):
        text += f"{i + 1}\t{i / 100:.5f}\t" * before + "\t".join(f"{v:.3f}" for v in row) + "\n"
    return text


@pytest.mark.parametrize(("columns", "before"), [(True, True), (False, False), (False, True)])
def test_markers_are_read_as_pandas_reads_them_and_zeros_are_missing(tmp_path, columns, before):
    text = markers(columns=columns, before=before)
    (tmp_path / "a.tsv").write_text(text)
    found = read(tmp_path / "a.tsv")
    theirs = pd.read_csv(io.StringIO(text), sep="\t", skiprows=10 + columns, header=None).to_numpy()[:, 2 * before :]
    expected = np.where(theirs == 0, np.nan, theirs).reshape(-1, 2, 3)
    np.testing.assert_array_equal(found.p, expected)
    assert np.isnan(found.p[3, 1]).all()
    assert found.names == ("bow", "stern é")
    assert found.start_s == pytest.approx(17 * 3600 + 47 * 60 + 17.25)
    assert found.unit == "mm"


def test_the_place_of_bodies_is_read_of_a_6d_file(tmp_path):
    names = "BODY_NAMES\tPSVH\n"
    text = HEAD.format(k=2, kind="6D", names=names) + "Frame\tTime\tPSVH X\tY\tZ\tRoll\tPitch\tYaw\tResidual"
    text += "".join(f"\tRot[{i}]" for i in range(9)) + "\t\n"
    row = "\t-194.91974\t2.24150\t0.99661\t-0.65\t0.09\t0.05\t4.98" + "\t1.00000" * 9 + "\t\n"
    (tmp_path / "a.tsv").write_text((text + "1\t0.00000" + row + "2\t0.01000" + row).replace("\n", "\r\n"))
    found = read(tmp_path / "a.tsv")
    assert found.p[:, 0].tolist() == [[-194.91974, 2.2415, 0.99661]] * 2


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (markers()[:-120], "of 20 frames|not a row"),
        (markers().replace("DATA_INCLUDED\t3D", "DATA_INCLUDED\tAnalog"), "no TSV of QTM"),
        (markers().replace("bow\tstern é\n", "bow\n", 1), "do not hold 1 markers"),
        ("a\tb\n1\t2\n", "no TSV of QTM"),
    ],
)
def test_a_file_that_is_not_whole_is_refused_in_one_line(tmp_path, text, what):
    (tmp_path / "a.tsv").write_text(text)
    with pytest.raises(VidtrackError, match=what) as error:
        read(tmp_path / "a.tsv")
    assert "\n" not in str(error.value)

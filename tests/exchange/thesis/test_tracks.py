import os

import numpy as np
import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.thesis.tracks import looks_like_tracks, read_taped, write_taped

HERE = os.path.join(os.path.dirname(__file__), "..", "..", "..", "data", "thesis")


def by_tsbackm(rows) -> str:
    """As the fprintf call of tsbackm.c prints samples, after four lines that were typed by hand."""
    return "a\nb\nc\nd\n" + "".join(f"{code:>13s}\t\t{x:7.2f}{y:7.2f}\n" for code, x, y in rows)


def test_samples_of_tsbackm_are_read_in_order_of_time_though_the_tape_ran_backwards(tmp_path):
    path = tmp_path / "cam1vid.prn"
    path.write_text(by_tsbackm([("10:00:55;02", 103.5, 200), ("10:00:55;01", 102, 201.25), ("10:00:54;29", 99, 202)]))
    found = read_taped(path)
    assert found.code == ("10:00:54:29", "10:00:55:01", "10:00:55:02")
    assert np.diff(found.frame).tolist() == [2, 1]
    assert found.b[:, 0].tolist() == [[99, 202], [102, 201.25], [103.5, 200]]


def test_a_place_that_tsbackm_printed_again_is_no_measurement_while_the_target_moves(tmp_path):
    path = tmp_path / "cam1vid.prn"
    rows = [("10:00:55:00", 0, 0), ("10:00:55:01", 0, 0)]
    rows += [(f"10:00:55:{k:02d}", 100 + 2.5 * (k if k != 9 else 8), 200.0) for k in range(2, 20)]
    path.write_text(by_tsbackm(rows))
    found = read_taped(path)
    lost = np.isnan(found.b[:, 0, 0])
    assert np.flatnonzero(lost).tolist() == [0, 1, 9]
    assert found.repeated == 1


def test_a_target_at_rest_may_repeat_its_place(tmp_path):
    path = tmp_path / "cam1vid.prn"
    path.write_text(by_tsbackm([(f"10:00:55:{k:02d}", 100.0, 200.01 if k % 3 else 200.0) for k in range(20)]))
    assert not np.isnan(read_taped(path).b).any()


def test_several_targets_and_numbers_that_run_into_each_other_are_read(tmp_path):
    path = tmp_path / "cam1vid.prn"
    path.write_text("a\nb\nc\nd\n  10:00:55:00\t\t 307.00-1234.56\t 10.00 20.00\n")
    assert read_taped(path).b.tolist() == [[[307.0, -1234.56], [10.0, 20.0]]]


def test_passes_of_the_automatic_tracking_become_one_record(tmp_path):
    path = tmp_path / "pass.prn"
    head = " Pass {} \n x       y       Frame \n===== \n"
    text = head.format(1) + "307   81  00:07:02:14  00:07:02:16\n309   74  00:07:02:26  00:07:02:28\n-1      -1      -1"
    text += "\n" + head.format(2) + "308   80  00:07:02:15  00:07:02:17\n-1      -1      -1"
    path.write_text(text)
    found = read_taped(path)
    assert found.code == ("00:07:02:14", "00:07:02:15", "00:07:02:26")
    assert found.b[:, 0].tolist() == [[307, 81], [308, 80], [309, 74]]


def test_samples_over_midnight_go_on(tmp_path):
    path = tmp_path / "cam1vid.prn"
    path.write_text(by_tsbackm([("23:59:59:29", 1, 2), ("00:00:00:01", 2, 3)]))
    assert np.diff(read_taped(path).frame).tolist() == [2]


def test_table_5_1_of_the_thesis_is_read_with_its_own_numbers(tmp_path):
    rows = np.loadtxt(os.path.join(HERE, "table-5.1.csv"), delimiter=",", dtype=str, skiprows=1)
    path = tmp_path / "cam1vid.prn"
    path.write_text("a\nb\nc\nd\n" + "".join(f"{c:>13s}\t\t{float(x):7.2f}{float(y):7.2f}\n" for c, x, y in rows))
    found = read_taped(path)
    assert len(found.code) + found.twice == len(rows)
    theirs = {c.replace(".", ":"): (float(x), float(y)) for c, x, y in rows}
    seen = np.isfinite(found.b[:, 0]).all(-1)
    for code, b in zip(np.array(found.code)[seen], found.b[seen, 0], strict=True):
        assert tuple(b) == theirs[code]


def test_samples_that_are_written_are_read_to_two_decimals(tmp_path):
    path = tmp_path / "cam1vid.prn"
    b = np.round(np.random.default_rng(0).uniform(0, 500, (30, 2, 2)), 2)
    codes = [f"10:00:{k // 30:02d}:{k % 30:02d}" for k in range(30)]
    b[4] = np.nan
    write_taped(path, codes, b)
    assert looks_like_tracks(path.read_text())
    found = read_taped(path)
    np.testing.assert_allclose(found.b, np.delete(b, 4, 0), atol=1e-9)


@pytest.mark.parametrize(
    ("rows", "what"),
    [
        ("  10:00:55:30\t\t 1.00 2.00\n", "no time code of NTSC"),
        ("  10:00:55:00\t\t 1.00\n", "1 numbers beside"),
        ("  10:00:55:00\t\t 1.00 2.00\n  10:00:55:01\t\t 1.00 2.00 3.00 4.00\n", "2 targets, and 1 before"),
        ("nothing\n", "no line with a time code"),
        ("  10:00:55:00\t\t 1.00 2.00\nnotes of the operator\n", "is no sample"),
    ],
)
def test_what_is_no_track_is_refused_in_one_line(tmp_path, rows, what):
    path = tmp_path / "cam1vid.prn"
    path.write_text("a\nb\nc\nd\n" + rows)
    with pytest.raises(VidtrackError, match=what) as error:
        read_taped(path)
    assert "\n" not in str(error.value)

"""An order is written when its content changes and at no other time, whole, or told why it cannot be."""

import json
import os
from pathlib import Path

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.workflow.order_files import OrderBook


@pytest.fixture
def raw(tmp_path):
    path = tmp_path / "reference.csv"
    path.write_text("time_s,x_in\n0,1\n")
    return str(path)


def test_an_order_is_written_again_only_when_its_content_changes(tmp_path, raw):
    def placed(settings):
        return OrderBook(str(tmp_path / "results")).place("compare", settings, [raw, None], "pluck")

    path = placed({"axis": "x", "units": "in"})
    assert path.endswith("results/.orders/compare.pluck.json")
    order = json.loads(Path(path).read_text())
    assert list(order["inputs"]) == [raw]
    os.utime(path, (1, 1))
    assert placed({"units": "in", "axis": "x"}) == path
    assert os.stat(path).st_mtime == 1
    os.utime(raw, (5, 5))
    placed({"axis": "x", "units": "in"})
    assert os.stat(path).st_mtime == 1
    with open(raw, "a") as file:
        file.write("1,2\n")
    placed({"axis": "x", "units": "in"})
    assert os.stat(path).st_mtime > 1


def test_a_job_of_the_workflow_writes_no_order(tmp_path, raw):
    assert not os.path.exists(OrderBook(str(tmp_path / "results"), writing=False).place("compare", {}, [raw]))


def test_an_input_that_cannot_be_read_is_told_by_name(tmp_path):
    with pytest.raises(VidtrackError, match=r"gone\.csv: cannot be read \(No such file"):
        OrderBook(str(tmp_path)).place("compare", {}, [str(tmp_path / "gone.csv")])


def test_results_that_cannot_be_written_are_told_in_a_line(tmp_path, raw):
    (tmp_path / "results").write_text("a file where a folder should be")
    with pytest.raises(VidtrackError, match=r"results/\.orders/compare\.json: cannot be written \(.*run again"):
        OrderBook(str(tmp_path / "results")).place("compare", {}, [raw])
    book = OrderBook(str(tmp_path / "elsewhere"))
    book.place("compare", {}, [raw])
    os.rename(tmp_path / "elsewhere", tmp_path / "moved")
    (tmp_path / "elsewhere").write_text("")
    with pytest.raises(VidtrackError, match=r"elsewhere/\.orders: cannot be written"):
        book.close()


def test_a_new_recording_that_is_none_is_told_before_its_checksum_is_remembered(tmp_path):
    clip = tmp_path / "cam1.mov"
    clip.write_bytes(b"this is a shopping list\n" * 9)
    for _ in range(2):
        book = OrderBook(str(tmp_path / "results"))
        book.place("track", {}, [str(clip)], "pluck", "cam1")
        with pytest.raises(VidtrackError, match=r"cam1\.mov"):
            book.close()

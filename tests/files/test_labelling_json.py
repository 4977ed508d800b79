"""labelling.json is read, or says why there is nothing to read."""

import pytest

from vidtrack.errors import VidtrackError
from vidtrack.files.labelling_json import read_labelling
from vidtrack.files.records import write_json


def test_a_record_is_read_as_it_was_written(tmp_path):
    write_json(tmp_path / "labelling.json", {"found": 64}, {})
    assert read_labelling(str(tmp_path / "labelling.json"))["found"] == 64


def test_why_nothing_was_labelled_is_raised_line_by_line(tmp_path):
    write_json(tmp_path / "labelling.json", {"failed": ["no ball", "a wrong pick"]}, {})
    with pytest.raises(VidtrackError) as error:
        read_labelling(str(tmp_path / "labelling.json"))
    assert error.value.problems == ("no ball", "a wrong pick")

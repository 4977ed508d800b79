"""What a table knows of itself."""

from vidtrack.report.page import Table


def test_a_column_holds_words_where_a_cell_begins_with_a_letter():
    rows = [["cam1", "0.2", "tmcd", "–"], ["cam2", "–", "–", "1/24,100"]]
    assert Table("", ["camera", "rms", "time from", "share"], rows).worded == [True, False, True, False]
    assert Table("", ["camera", "rms"], []).worded == [True, True]

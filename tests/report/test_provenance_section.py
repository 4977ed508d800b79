"""The end of a page: settings as they were, once each, with whom they concern."""

from vidtrack.report.provenance_section import provenance_section

MADE = {
    "vidtrack": "1.2",
    "commit": "abc",
    "libraries": {"numpy": "2.0"},
    "rule": "track",
    "settings": {"camera": "cam1", "detect": {"threshold": 90, "start": None, "box": [50, 40]}},
    "inputs": {"runs/a/cam1.mov": "f" * 64, "results/runs/a/locate.json": "0" * 64},
}


def test_settings_are_named_by_their_path_and_shared_ones_stand_once():
    other = {"provenance": {**MADE, "settings": {"camera": "cam2", "detect": {"threshold": 70, "box": [50, 40]}}}}
    section = provenance_section([("cam1", {"provenance": MADE}), ("cam2", other), ("", None)], "in")
    settings, files, programs = section.tables
    assert settings.rows == [
        ["track", "detect.threshold", "90", "cam1"],
        ["track", "detect.box", "50, 40", "cam1, cam2"],
        ["track", "detect.threshold", "70", "cam2"],
    ]
    assert files.rows == [["runs/a/cam1.mov", "f" * 64]]
    assert programs.rows == [["vidtrack", "1.2"], ["commit", "abc"], ["numpy", "2.0"]]
    assert section.key == "provenance"


def test_without_records_there_is_no_section():
    assert provenance_section([("", None), ("", {})], "in") is None

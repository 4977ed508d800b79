from vidtrack.report.footer import footer


def test_a_page_that_was_made_without_a_commit_says_its_version_alone():
    assert footer({"vidtrack": "1"}, "m")[1].startswith("Made by vidtrack 1. Settings")

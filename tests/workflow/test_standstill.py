"""Whether nothing has to be planned: only where the plan is that which was finished, and all results are settled."""

import pytest

from vidtrack.workflow.standstill import FILE, checksum_of_plan, is_finished, note_finished


@pytest.fixture
def rules(tmp_path):
    place = tmp_path / "workflow"
    (place / "rules").mkdir(parents=True)
    (place / "Snakefile").write_text("include: 'rules/one.smk'\n")
    (place / "rules/one.smk").write_text("rule one:\n")
    return place


def test_what_was_finished_is_known_and_nothing_else(tmp_path, rules):
    plan = checksum_of_plan(str(rules), {"runs": 3})
    assert not is_finished(str(tmp_path), plan, ["a"], {"a"})
    note_finished(str(tmp_path), plan)
    assert is_finished(str(tmp_path), plan, ["a"], {"a", "b"})
    assert not is_finished(str(tmp_path), checksum_of_plan(str(rules), {"runs": 4}), ["a"], {"a", "b"})


def test_a_result_that_is_not_settled_is_planned_for(tmp_path, rules):
    plan = checksum_of_plan(str(rules))
    note_finished(str(tmp_path), plan)
    assert not is_finished(str(tmp_path), plan, ["a", "lost"], {"a"})


@pytest.mark.parametrize("name", ["Snakefile", "rules/one.smk", "rules/two.smk"])
def test_a_rule_that_changed_or_came_is_another_plan(rules, name):
    before = checksum_of_plan(str(rules))
    path = rules / name
    path.write_text((path.read_text() if path.exists() else "") + "# other\n")
    assert checksum_of_plan(str(rules)) != before


def test_what_is_not_a_rule_counts_for_nothing(rules):
    before = checksum_of_plan(str(rules))
    (rules / "rules/.one.smk.swp").mkdir()
    (rules / "environment.yaml").write_text("name: vidtrack\n")
    assert checksum_of_plan(str(rules)) == before


def test_parts_are_not_run_together(rules):
    assert checksum_of_plan(str(rules), "ab", "c") != checksum_of_plan(str(rules), "a", "bc")


def test_a_damaged_note_means_planning_as_usual(tmp_path, rules):
    plan = checksum_of_plan(str(rules))
    note_finished(str(tmp_path), plan)
    (tmp_path / FILE).write_bytes(b"\xff" + plan.encode()[1:])
    assert not is_finished(str(tmp_path), plan, [], set())


def test_a_cache_that_cannot_be_written_stops_nothing(tmp_path, rules):
    (tmp_path / "cache").write_text("a file where the folder should be")
    note_finished(str(tmp_path / "cache"), "0")
    assert not is_finished(str(tmp_path / "cache"), "0", [], set())

"""What Snakemake's own lint says of the rules, and what its catalog asks of a workflow."""

import re
import shutil

import pytest
import yaml

from tests.whole_workflow.conftest import REPO, snakemake

RULES = sorted((REPO / "workflow/rules").glob("*.smk"))


def test_snakemake_lints_nothing(laboratory):
    answer = snakemake(laboratory, "--lint")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "Congratulations, your workflow is in a good condition!" in answer.stdout + answer.stderr


def test_the_lint_would_tell(laboratory, tmp_path):
    """What is said to be clean is read: a rule without a log and without a container is told."""
    rule = 'rule all:\n    output: "a"\n    shell: "touch {output}"\n'
    (tmp_path / "Snakefile").write_text(rule)
    answer = snakemake(laboratory, "--lint", "-s", str(tmp_path / "Snakefile"))
    assert "Lints for rule all" in answer.stdout + answer.stderr


@pytest.mark.parametrize("page", RULES, ids=lambda path: path.stem)
def test_each_rule_says_what_it_takes_and_measures_it(page):
    """The rendering of the demo alone is no measured part of an experiment."""
    rules = re.split(r"^ *rule\b[ \w]*:$", page.read_text(), flags=re.MULTILINE)[1:]
    for rule in rules:
        for word in ("log:", "message:", "resources:", "mem_mb=", "runtime="):
            assert word in rule, (page.name, word)
        assert ("benchmark:" in rule) == (page.stem != "rendering")


def test_no_rule_quotes_by_hand():
    for page in RULES:
        for shell in page.read_text().split("    shell:\n")[1:]:
            command = re.split(r"\n\n\n", shell)[0]
            for place in re.findall(r"\{(?:input|output|log|params)\b(?:[^{}]|\{i\})*\}", command):
                assert place.endswith(":q}"), (page.name, place)


def test_the_catalogs_test_is_planned_from_a_fresh_checkout(tmp_path):
    """.test holds a config and a scenario; the experiment is rendered first, and then Snakemake is called again."""
    folder = shutil.copytree(REPO / ".test", tmp_path / "test", ignore=shutil.ignore_patterns("small", ".snakemake"))
    assert snakemake(folder, "--list", "-s", str(REPO / "workflow/Snakefile")).returncode == 0
    assert sorted(p.name for p in folder.iterdir() if p.name != ".snakemake") == ["config.yaml", "small.yaml"]
    answer = snakemake(folder, "-n", "-s", str(REPO / "workflow/Snakefile"))
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "Rendering small from small.yaml" in answer.stdout
    assert sorted(p.name for p in folder.iterdir() if p.name != ".snakemake") == ["config.yaml", "small.yaml"]


def test_the_catalog_finds_what_it_looks_for():
    usage = yaml.safe_load((REPO / ".snakemake-workflow-catalog.yml").read_text())["usage"]
    assert {"mandatory-flags", "software-stack-deployment", "report"} <= set(usage)
    deployed, workflow = usage["software-stack-deployment"], (REPO / "workflow/Snakefile").read_text()
    assert deployed["apptainer"] == ("\ncontainer:" in workflow)
    assert deployed["conda"] == any("    conda:" in page.read_text() for page in RULES)
    for name in (
        "workflow/Snakefile",
        "config/README.md",
        "workflow/profiles/default/config.yaml",
        ".test/config.yaml",
    ):
        assert (REPO / name).is_file()

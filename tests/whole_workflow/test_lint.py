"""What Snakemake's own lint says of the rules."""

import re

from tests.whole_workflow.conftest import snakemake

STANDING = (
    # requirements.lock pins every package, by hash, for all rules at once
    "Specify a conda environment or container for each rule.",
    # the Snakefile sets these for its jobs; it takes nothing from them that a job's result could depend on
    "Environment variable PATH",
    "Environment variable PYTHONPATH",
    # a rule's input functions stand beside it, in a file of few rules
    "Mixed rules and functions in same snakefile.",
)


def test_snakemake_lints_nothing_but_what_is_meant(laboratory):
    answer = snakemake(laboratory, "--lint")
    said = answer.stdout + answer.stderr
    assert "Lints for rule locate" in said, said
    lints = re.findall(r"^    \* (.*):$", said, re.MULTILINE)
    assert [lint for lint in lints if not lint.startswith(STANDING)] == []

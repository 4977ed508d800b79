"""What Snakemake's own lint says of the rules."""

import re

from tests.workflow.conftest import snakemake

PINNED = "Specify a conda environment or container for each rule."
"""The one lint that stands: requirements.lock pins every package, by hash, for all rules at once."""


def test_snakemake_lints_nothing_but_the_environment_that_the_lock_file_pins(laboratory):
    answer = snakemake(laboratory, "--lint")
    said = answer.stdout + answer.stderr
    assert "Lints for rule locate" in said, said
    assert set(re.findall(r"^    \* (.*):$", said, re.MULTILINE)) == {PINNED}

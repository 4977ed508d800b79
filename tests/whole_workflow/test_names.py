"""Names of runs are data: nothing in them is carried out, and no two runs share a file."""

import os

from tests.whole_workflow.conftest import snakemake

HOSTILE = "x'$(touch PWNED)'y `touch PWNED` ; touch PWNED #-ü"


def test_a_name_that_a_shell_would_carry_out_is_only_a_name(laboratory):
    folder = laboratory / "runs" / HOSTILE
    os.rename(laboratory / "runs/still", folder)
    answer = snakemake(laboratory)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert not list(laboratory.rglob("PWNED"))
    assert (laboratory / "results/runs" / HOSTILE / "trajectories.parquet").exists()
    assert f"vidtrack: run {HOSTILE}: good" in answer.stderr


def test_a_recording_elsewhere_may_have_a_name_like_an_option(laboratory):
    os.rename(laboratory / "runs/still/cam1.mov", laboratory / "--log.mov")
    config = laboratory / "config.yaml"
    config.write_text(config.read_text() + "  still:\n    videos: {cam1: '--log.mov'}\n")
    answer = snakemake(laboratory, "results/runs/still/centroids/cam1.parquet")
    assert answer.returncode == 0, answer.stdout + answer.stderr

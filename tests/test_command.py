import json
import subprocess
import sys
from pathlib import Path

import pytest

from vidtrack.command import COMMANDS, main

REPO = Path(__file__).parents[1]


def test_the_schema_is_printed(capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((REPO / "workflow/schemas/config.schema.json").read_text())


def test_a_scenario_is_listed(capsys):
    assert main(["simulate", str(REPO / "data/demo.yaml"), "nowhere", "--list"]) == 0
    assert "runs/pluck/cam1.mov" in capsys.readouterr().out.splitlines()


def test_a_rule_is_run_as_by_the_workflow(capsys, monkeypatch):
    monkeypatch.setattr(sys.stdin, "read", lambda *_: "")
    assert main(["rule", "track"]) == 1
    assert "no order on the standard input" in capsys.readouterr().err


def test_a_plan_that_is_not_there_is_told_in_one_line(capsys, tmp_path):
    assert main(["sensitivity", str(tmp_path / "none.yaml"), str(tmp_path / "out")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("vidtrack: ")
    assert "no such file" in line


def test_an_unknown_command_is_told_with_a_near_one(capsys):
    assert main(["simulat"]) == 2
    assert capsys.readouterr().err == "vidtrack: no command 'simulat'; did you mean 'simulate'?\n"


def test_help_names_every_command(capsys):
    assert main([]) == 0
    said = capsys.readouterr().out
    assert all(f"vidtrack {name} " in said for name in COMMANDS)


@pytest.mark.parametrize("heavy", ["numpy", "pydantic", "snakemake", "pandas"])
def test_help_loads_nothing_heavy(heavy):
    code = f"import sys; from vidtrack.command import main; main([]); sys.exit({heavy!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, check=False).returncode == 0

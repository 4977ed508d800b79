import json
import os
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


@pytest.mark.parametrize("name", ["tutorial", "demo", "float"])
def test_a_scenario_that_comes_with_vidtrack_is_found_by_its_name_anywhere(capsys, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", name, "nowhere", "--list"]) == 0
    assert "config.yaml" in capsys.readouterr().out.splitlines()
    (tmp_path / name).write_text("units: m\n")  # a file of that name comes first
    assert main(["simulate", name, "nowhere", "--list"]) == 1


def test_what_the_commands_name_is_in_the_wheel():
    import tomllib

    from vidtrack.workflow.shipped import PLANS, SCENARIOS

    own = tomllib.loads((REPO / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    for parts in (*SCENARIOS.values(), *PLANS.values()):
        assert own["force-include"]["/".join(parts)] == "/".join(("vidtrack/shipped", *parts))
        assert (REPO / "/".join(parts)).is_file()


def test_a_rule_is_run_as_by_the_workflow(capsys, monkeypatch):
    monkeypatch.setattr(sys.stdin, "read", lambda *_: "")
    assert main(["rule", "track"]) == 1
    assert "no order on the standard input" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["plan", "sensitivity"])
def test_a_plan_that_is_not_there_is_reported_in_one_line(capsys, tmp_path, name):
    assert main([name, str(tmp_path / "none.yaml"), str(tmp_path / "out")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("vidtrack: ")
    assert "no such file" in line


def test_an_unknown_command_is_refused_with_a_near_one(capsys):
    assert main(["simulat"]) == 2
    assert capsys.readouterr().err == "vidtrack: no command 'simulat'; did you mean 'simulate'?\n"


def test_an_option_that_is_unknown_is_refused_in_one_line(capsys):
    assert main(["run", "--corse", "2"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--corse" in line


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"]])
def test_help_names_every_command(capsys, arguments):
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert all(f"\n  {name} " in said for name in COMMANDS)
    assert "Examples:" in said


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_every_command_has_an_example_and_fits_80_columns(capsys, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "80")
    if name == "rule":
        with pytest.raises(SystemExit) as ended:
            main([name, "--help"])
        assert ended.value.code == 0
    else:
        assert main([name, "--help"]) == 0
    said = capsys.readouterr().out
    assert said.lower().startswith("usage:")
    assert "Example" in said
    assert f"vidtrack {name}" in said.partition("Example")[2]
    assert max(map(len, said.splitlines())) <= 80


WRONG = [
    ["init"],
    ["init", ".", "--units", "furlong"],
    ["init", ".", "--camera", "x"],
    *([name, "nowhere"] for name in ("init", "check", "pick", "run", "report", "unlock", "doctor")),
    *([name, "empty"] for name in ("check", "pick", "run", "report")),
    *([name, ".", "--wrong"] for name in ("init", "check", "pick", "run", "report", "export", "unlock", "doctor")),
    ["pick", ".", "--port", "99999"],
    ["run", ".", "--cores", "0"],
    ["run", ".", "empty"],
    ["import", "nowhere", "new", "--units", "m"],
    ["export", ".", "--to", "nothing"],
    ["plan"],
    ["plan", "nowhere", "out"],
    ["plan", "board", "out.pdf", "--type", "nothing"],
    ["simulate", "nowhere", "out"],
    ["simulate", "tutorial", "out", "--seed", "x"],
    ["schema", "more"],
    ["completion"],
    ["completion", "tcsh"],
    ["rule"],
    ["rule", "track", "--wrong"],
]


@pytest.mark.parametrize("arguments", WRONG, ids=" ".join)
def test_wrong_arguments_are_refused_in_one_line_and_nothing_is_written(capsys, monkeypatch, tmp_path, arguments):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    if arguments[0] == "rule":
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        code = ended.value.code
    else:
        code = main(arguments)
    said = capsys.readouterr()
    assert code in (1, 2)
    (line,) = said.err.splitlines()
    assert line.startswith("vidtrack: ")
    assert said.out == ""
    assert [path.name for path in tmp_path.rglob("*")] == ["empty"]


@pytest.mark.parametrize("arguments", [[], ["init", "--help"], ["run", "--help"]])
@pytest.mark.parametrize("heavy", ["numpy", "pydantic", "snakemake", "pandas", "rich"])
def test_help_loads_nothing_heavy(heavy, arguments):
    code = f"import sys; from vidtrack.command import main; main({arguments}); sys.exit({heavy!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, check=False).returncode == 0


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_tab_key_completes_commands(capsys, shell):
    assert main(["completion", shell]) == 0
    assert "_VIDTRACK_COMPLETE" in capsys.readouterr().out
    environment = {
        "_VIDTRACK_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": "vidtrack un",
        "COMP_CWORD": "1" if shell != "fish" else "un",
    }
    code = "from vidtrack.command import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    assert "unlock" in done.stdout

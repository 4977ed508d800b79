"""The console script `vidtrack`: what can be done without Snakemake. Each command loads only what it needs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Do what the first argument names with those that follow; its exit code, 2 where there is no such command."""
    name, *rest = (sys.argv[1:] if argv is None else list(argv)) or ["--help"]
    if name in ("-h", "--help"):
        sys.stdout.write(_usage())
        return 0
    if name not in COMMANDS:
        from vidtrack.naming import did_you_mean

        near = did_you_mean(name, COMMANDS)
        hint = f"did you mean {near!r}?" if near else f"there are {', '.join(COMMANDS)}."
        sys.stderr.write(f"vidtrack: no command {name!r}; {hint}\n")
        return 2
    return COMMANDS[name][0](rest)


def _rule(arguments: Sequence[str]) -> int:
    from vidtrack.workflow.entry import main as run_rule

    return run_rule(arguments)


def _simulate(arguments: Sequence[str]) -> int:
    from vidtrack.simulate.__main__ import main as simulate

    return simulate(arguments)


def _sensitivity(arguments: Sequence[str]) -> int:
    from vidtrack.jobs.sensitivity import main as predict

    return predict(arguments)


def _schema(_: Sequence[str]) -> int:
    from vidtrack.settings.config import schema_text

    sys.stdout.write(schema_text())
    return 0


COMMANDS: dict[str, tuple[Callable[[Sequence[str]], int], str]] = {
    "simulate": (_simulate, "SCENARIO FOLDER   render an experiment from a scenario"),
    "sensitivity": (_sensitivity, "PLAN FOLDER    predict the accuracy of a rig, and what it depends on"),
    "schema": (_schema, "                    print the JSON schema of config.yaml"),
    "rule": (_rule, "RULE ...              run one rule of the workflow, as Snakemake does"),
}


def _usage() -> str:
    lines = [f"  vidtrack {name} {told}\n" for name, (_, told) in COMMANDS.items()]
    return (
        "usage: vidtrack COMMAND ...\n\n"
        + "".join(lines)
        + "\nAn experiment is processed by Snakemake: see README.md.\n"
    )


if __name__ == "__main__":
    sys.exit(main())

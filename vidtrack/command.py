"""The console script `vidtrack`: from a folder of recordings to a report. Each command loads only what it needs."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from typing import Any

import click

COMMANDS = {
    "init": "Look through a folder of recordings and write config.yaml and points.csv.",
    "check": "Say what will happen with an experiment, and what is wrong with it. Runs nothing.",
    "pick": "Pick calibration points, start boxes and thresholds in the browser.",
    "run": "Process everything that is not done yet, and say the verdict.",
    "report": "Open the report.",
    "import": "Make an experiment of the files of older programs.",
    "export": "Write results in the format of another program: C3D, NetCDF, QTM, ...",
    "unlock": "Remove the lock that a killed run left behind.",
    "plan": "Predict the accuracy of a rig before it is built.",
    "simulate": "Render a whole experiment from a scenario.",
    "doctor": "Versions, codecs, cores and memory: the facts that a bug report needs.",
    "schema": "Print the JSON schema of config.yaml.",
    "completion": "Print what a shell needs to complete commands with the tab key.",
    "rule": "Run one rule of the workflow, as Snakemake does.",
}
"""What there is to do; `vidtrack.commands.<name>` does it."""

MODULES = {"import": "import_files"}
"""Modules of commands whose names no module can have."""

OLDER = {"sensitivity": "plan"}
"""Names that commands had before."""

_EXAMPLES = """
\b
Examples:
  vidtrack init my-lab --units m      what lies there, and a config.yaml
  vidtrack check my-lab               what will happen, and what is wrong
  vidtrack pick my-lab                points and boxes, in the browser
  vidtrack run my-lab                 everything, with the verdict last
"""


class _Late(click.Group):
    """Commands by name; a command's module is loaded when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        name = OLDER.get(name, name)
        if name not in COMMANDS:
            return None
        module = MODULES.get(name, name)
        command: click.Command = importlib.import_module(f"vidtrack.commands.{module}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in (*COMMANDS, *OLDER) and not args[0].startswith("-"):
            from vidtrack.naming import hint_of

            hint = hint_of(args[0], COMMANDS, f"there are {', '.join(COMMANDS)}.")
            raise click.UsageError(f"no command {args[0]!r}; {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(
    cls=_Late,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=_EXAMPLES,
    no_args_is_help=True,
)
@click.version_option(package_name="vidtrack")
def vidtrack() -> None:
    """Positions in space, with time and uncertainty, from recorded video.

    An experiment is a folder: config.yaml, calibration/ and runs/. Snakemake does the work, and may be called as it is.
    """


def main(argv: Sequence[str] | None = None) -> int:
    """Do what the arguments ask for; the exit code: 0 done, 1 refused or failed, 2 no such command, 130 stopped."""
    from vidtrack.errors import VidtrackError

    try:
        answer: Any = vidtrack.main(None if argv is None else list(argv), prog_name="vidtrack", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as shown:
        sys.stdout.write(shown.format_message() + "\n")
        return 0
    except click.ClickException as error:
        sys.stderr.write(f"vidtrack: {_in_one_line(error)}\n")
        return 2
    except (click.Abort, KeyboardInterrupt):
        sys.stderr.write("vidtrack: stopped.\n")
        return 130
    except VidtrackError as error:
        sys.stderr.write("".join(f"vidtrack: {problem}\n" for problem in error.problems))
        return 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        sys.stderr.write(f"vidtrack: {where}{error.strerror or error}. Correct the cause and call again.\n")
        return 1
    return answer if isinstance(answer, int) else 0


def _in_one_line(error: click.ClickException) -> str:
    """What is wrong with the arguments, and where it stands what they may be."""
    said = " ".join(error.format_message().split())
    asked = error.ctx if isinstance(error, click.UsageError) else None
    return said if asked is None or asked.parent is None else f"{said.rstrip('.')}. See {asked.command_path} --help."


if __name__ == "__main__":
    sys.exit(main())

"""vidtrack report: the page that a run wrote."""

from __future__ import annotations

import os
import sys

import click

from vidtrack.commands.folder import FOLDER, inside, settings_here
from vidtrack.errors import VidtrackError

_EXAMPLES = """
\b
Examples:
  vidtrack report my-lab
  firefox $(vidtrack report my-lab --print)
"""


@click.command("report", epilog=_EXAMPLES)
@FOLDER
@click.option("--print", "only_path", is_flag=True, help="Print its path instead of opening it.")
def command(folder: str, only_path: bool) -> None:
    """Open the report of FOLDER in the browser; where there is none, print its path."""
    from vidtrack.files.experiment import within

    with inside(folder):
        path = os.path.abspath(within(settings_here().experiment, "results", "report.html"))
    if not os.path.isfile(path):
        raise VidtrackError(f"{path}: not written yet. Call vidtrack run {folder} first.")
    opened = not only_path and sys.stdout.isatty() and _open(path)
    if not opened:
        click.echo(path)


def _open(path: str) -> bool:
    import pathlib
    import webbrowser

    try:
        return webbrowser.open(pathlib.Path(path).as_uri())
    except webbrowser.Error:
        return False

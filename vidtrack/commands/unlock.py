"""vidtrack unlock: the lock that a killed run left."""

from __future__ import annotations

import os
import sys

import click

from vidtrack.commands.folder import FOLDER
from vidtrack.errors import VidtrackError

_EXAMPLES = """
\b
Examples:
  vidtrack unlock my-lab     after a power cut, or a run that was killed
"""


@click.command("unlock", epilog=_EXAMPLES)
@FOLDER
def command(folder: str) -> None:
    """Remove the lock that a killed Snakemake left in FOLDER; refused while one works there."""
    from vidtrack.workflow.lock import at_work, is_locked, remove_lock

    if not os.path.isdir(folder):
        raise VidtrackError(f"{folder}: no such folder. Correct the name.")
    if not is_locked(folder):
        click.echo(f"{folder} is not locked.")
        return
    if holder := at_work(folder):
        raise VidtrackError(f"{folder}: a snakemake works here (process {holder}). Wait for its end, or stop it.")
    remove_lock(folder)
    click.echo(f"{folder}: the lock is removed.")


def free_lock(folder: str, yes: bool) -> None:
    """Remove a stale lock after asking, or at once with `yes`; VidtrackError where the folder stays locked."""
    from vidtrack.workflow.lock import at_work, free_of_killed, is_locked, remove_lock

    if not is_locked(folder):
        return
    if killed := free_of_killed(folder):
        click.echo(f"removed the lock of a run that was killed (process {killed})", err=True)
        return
    if holder := at_work(folder):
        raise VidtrackError(f"{folder}: a snakemake works here (process {holder}). Wait for its end, or stop it.")
    why = f"{folder} is locked by a run that was killed; no process of this computer works there."
    if not yes and sys.stdin.isatty():
        yes = click.confirm(f"{why} Remove the lock? (not if another computer works there)", default=True)
    if not yes:
        raise VidtrackError(f"{why} If no other computer works there: vidtrack unlock, or vidtrack run --yes.")
    remove_lock(folder)
    click.echo("the lock of a killed run is removed", err=True)

"""vidtrack import: files of older programs become an experiment folder."""

from __future__ import annotations

import os

import click

from vidtrack.errors import VidtrackError

_EXAMPLES = """
\b
Examples:
  vidtrack import old-disk my-lab --units in
  vidtrack import old-disk my-lab --units in --calibration old --run P12-B
"""


@click.command("import", epilog=_EXAMPLES)
@click.argument("old", type=click.Path())
@click.argument("folder", type=click.Path(file_okay=False))
@click.option(
    "--units", type=click.Choice(["m", "cm", "mm", "in", "ft"]), help="The unit of the survey; no file has it."
)
@click.option(
    "--calibration",
    type=click.Choice(["points", "old"]),
    default="points",
    show_default=True,
    help="points: calibrate anew from cam1.prn; old: take calb's outcam1.prn as it is.",
)
@click.option("--run", default="run", show_default=True, help="What the run of cam1vid.prn is called.")
def command(old: str, folder: str, units: str | None, calibration: str, run: str) -> int:
    """Make the experiment FOLDER of the files of the thesis's programs in the folder OLD.

    camparm.dat, balls.dat or targets.dat, cam1.prn or outcam1.prn, cam1vid.prn. Single files of other programs need no
    command: put runs/<run>/<camera>.csv or calibration/<camera>.toml in place of the recordings.
    """
    from vidtrack.arranging.old_files import old_folder, write_experiment
    from vidtrack.settings.commented import commented_config

    if os.path.isfile(old):
        ending = os.path.splitext(old)[1]
        raise VidtrackError(
            f"{old}: a file, and a folder of the thesis's files is imported. A single file needs no import: put tracks "
            f"at runs/<run>/<camera>{ending} of the experiment's folder, a calibrated camera at "
            f"calibration/<camera>{ending}."
        )
    if not os.path.isdir(old):
        raise VidtrackError(f"{old}: no such folder. Name the one with camparm.dat.")
    if units is None:
        raise VidtrackError("the unit of lengths is not known, and no old file states it. Give it: --units in")
    found = old_folder(old, units, calibration=calibration, run=run)
    head = f"Made by vidtrack import of {os.path.basename(os.path.abspath(old))}."
    for path in write_experiment(found, folder, commented_config(found.config, head)):
        click.echo(f"written: {path}")
    for note in found.notes:
        click.echo(f"note: {note}")
    click.echo(f"to do: vidtrack run {folder}")
    return 0

"""vidtrack init: from recordings in any arrangement to an experiment folder."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from vidtrack.commands.lines import say
from vidtrack.errors import VidtrackError

if TYPE_CHECKING:
    from vidtrack.arranging.arrangement import Arrangement
    from vidtrack.arranging.inventory import Recording

UNITS = ("m", "cm", "mm", "in", "ft")

_EXAMPLES = """
\b
Examples:
  vidtrack init my-lab --units m
  vidtrack init my-lab --units in --link
  vidtrack init my-lab --units m --camera east='*_A.mp4' \\
      --camera west='*_B.mp4' --clip dots='dots_*'
"""


class _Named(click.ParamType[tuple[str, str]]):
    """NAME=PATTERN."""

    name = "name=pattern"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        name, equals, pattern = str(value).partition("=")
        if not (name and equals and pattern):
            self.fail(f"{value!r} is not NAME=PATTERN, such as east='*_A.mp4'", param, ctx)
        return name, pattern


@click.command("init", epilog=_EXAMPLES)
@click.argument("folder", type=click.Path(file_okay=False))
@click.option(
    "--units", type=click.Choice(UNITS), help="The unit of every length in the world; asked for if not given."
)
@click.option("--link", "how", flag_value="link", help="Link recordings to where an experiment has them.")
@click.option("--copy", "how", flag_value="copy", help="Copy them there.")
@click.option("--move", "how", flag_value="move", help="Move them there.")
@click.option("--leave", "how", flag_value="leave", help="Leave them; config.yaml names those of the runs.")
@click.option("--camera", "cameras", multiple=True, type=_Named(), help="Recordings of one camera: NAME=PATTERN.")
@click.option("--clip", "clips", multiple=True, type=_Named(), help="Recordings of a calibration clip: NAME=PATTERN.")
@click.option("--run", "runs", multiple=True, type=_Named(), help="Recordings of a run: NAME=PATTERN.")
@click.option("--join", "join", multiple=True, metavar="PATTERN", help="Files that are one recording: 'swim_?.mp4'.")
@click.option("--no-join", is_flag=True, help="Take every file for a recording of its own.")
@click.option("--dry-run", is_flag=True, help="Show what is proposed, and write nothing.")
@click.option("--yes", is_flag=True, help="Ask nothing: take what is proposed.")
def command(
    folder: str,
    units: str | None,
    how: str | None,
    cameras: tuple[tuple[str, str], ...],
    clips: tuple[tuple[str, str], ...],
    runs: tuple[tuple[str, str], ...],
    join: tuple[str, ...],
    no_join: bool,
    dry_run: bool,
    yes: bool,
) -> int:
    """Look through FOLDER and propose cameras, calibration clips and runs; write config.yaml and points.csv.

    Recordings may lie in any arrangement: a folder for each camera or test, or all in one place with camera and test
    in their names. Files that one recording was split into are joined where their time stamps, time code or times of
    creation run on. Nothing is overwritten.
    """
    from vidtrack.arranging.arrangement import Wishes, arranged
    from vidtrack.arranging.folder import home, write_folder
    from vidtrack.arranging.inventory import recordings_in

    if not os.path.isdir(folder):
        raise VidtrackError(f"{folder}: no such folder. Make it, and put the recordings there.")
    asks = sys.stdin.isatty() and not yes
    recordings, notes = with_parts_joined(folder, recordings_in(folder), join, asks, not no_join)
    found = arranged(recordings, Wishes(cameras, clips, runs))
    found.notes.extend(notes)
    if not found.cameras:
        raise VidtrackError(f"{folder}: no recording in it or in its folders. Put the videos there, and call again.")
    show(found)
    if dry_run:
        return 0
    if units is None:
        if not asks:
            raise VidtrackError(f"the unit of lengths is not known. Give it: --units {'|'.join(UNITS)}")
        units = click.prompt("The unit of every length in the world", type=click.Choice(UNITS))
    away = [r.path for t in found.takes for c, r in t.recordings.items() if r.path != home(t, c)]
    if how is None and away and asks:
        how = click.prompt(
            f"{len(away)} recordings lie elsewhere than an experiment has them: link, copy, move or leave them",
            type=click.Choice(["link", "copy", "move", "leave"]),
            default="link",
        )
    if asks and not click.confirm("Write this?", default=True):
        return 1
    done = write_folder(folder, found, units or "", how or "leave")
    for path in done.written:
        say(f"written: {path}")
    for source, goal in done.placed:
        say(f"{how}: {source} -> {goal}")
    for line in done.left:
        say(f"left: {line}")
    for line in still_to_do(folder, found, how or "leave"):
        say(f"to do: {line}")
    return 0


def with_parts_joined(
    folder: str, recordings: list[Recording], join: Sequence[str], asks: bool, look: bool
) -> tuple[list[Recording], list[str]]:
    """The recordings with the parts of one as one, and a note for each series; asked about where nothing shows it."""
    from vidtrack.arranging.continuation import facts_of, joined_where, series_among, wished_together

    notes: list[str] = []
    if join:
        recordings = joined_where(recordings, wished_together(recordings, join))
    chosen = []
    for series in series_among(recordings, lambda path: facts_of(os.path.join(folder, path))) if look else ():
        names = ", ".join(recording.path for recording in series.recordings)
        if series.goes_on:
            notes.append(f"{names}: taken for one recording, by {series.why}; with --no-join each is one of its own")
            chosen.append(series.recordings)
        elif asks and click.confirm(f"{names}: are these parts of one recording?", default=False):
            chosen.append(series.recordings)
        elif not asks:
            pattern = re.sub(r"\d+(?=\D*$)", "*", os.path.splitext(os.path.basename(series.recordings[0].path))[0])
            notes.append(
                f"{names}: may be parts of one recording, but nothing in them shows it; each is taken for one of its "
                f"own. If they belong together: --join '{pattern}{os.path.splitext(series.recordings[0].path)[1]}'"
            )
    return joined_where(recordings, chosen), notes


def show(found: Arrangement) -> None:
    """Print what is proposed."""
    say(f"cameras: {', '.join(found.cameras)}")
    for kind, title in (("calibration", "calibration clips"), ("run", "runs")):
        takes = found.of(kind)
        none = "none found" if kind == "run" else "none found by their names. Name one: --clip NAME=PATTERN"
        say(f"{title}: {', '.join(take.name for take in takes) or none}")
        for take in takes:
            for camera, recording in take.recordings.items():
                parts = f" and {len(recording.parts) - 1} more ({recording.kind})" if len(recording.parts) > 1 else ""
                say(f"  {take.name}/{camera}: {recording.path}{parts}")
            missing = [camera for camera in found.cameras if camera not in take.recordings]
            if missing:
                say(f"  {take.name}: nothing from {', '.join(missing)}")
    for recording, why in found.left:
        say(f"left out: {recording.path}: {why}")
    for note in found.notes:
        say(f"note: {note}")


def still_to_do(folder: str, found: Arrangement, how: str) -> list[str]:
    """What a person has to do before the experiment can be processed."""
    from vidtrack.arranging.folder import home

    lines = []
    clips = found.of("calibration")
    away = [f"{r.path} -> {home(t, c)}" for t in clips for c, r in t.recordings.items() if r.path != home(t, c)]
    if away and how == "leave":
        lines.append(
            f"calibration clips are looked for in calibration/<clip>/<camera>: {len(away)} lie elsewhere, such as "
            f"{away[0]}. Call again with --link, --copy or --move."
        )
    if not clips and len(found.cameras) > 1:
        lines.append(
            "film calibration points with every camera, into calibration/<clip>/<camera>.<ext>, or name --clip."
        )
    points = os.path.join(folder, "calibration", "points.csv")
    with open(points, encoding="utf-8", errors="replace") as file:
        if len(file.read().splitlines()) < 2:
            lines.append(f"write the surveyed points into {points}: tag,x,y,z,sigma")
    lines.append(f"vidtrack pick {folder}   say which ball is which, and where targets start")
    lines.append(f"vidtrack check {folder}   what will come of it, and what is wrong")
    lines.append(f"vidtrack run {folder}   everything, with the verdict last")
    return lines

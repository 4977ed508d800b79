"""vidtrack export: results that exist as files of other programs."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import click

from vidtrack.commands.folder import FOLDER, inside, settings_here
from vidtrack.errors import VidtrackError

if TYPE_CHECKING:
    from vidtrack.exchange.formats import Layout
    from vidtrack.exchange.measured import Written
    from vidtrack.settings.config import Settings

_EXAMPLES = """
\b
Examples:
  vidtrack export my-lab --to c3d
  vidtrack export my-lab --to qtm --run pluck --output for-matlab
  vidtrack export --list
"""


@click.command("export", epilog=_EXAMPLES)
@FOLDER
@click.option("--to", "formats", metavar="FORMAT", multiple=True, help="A format; may be given again for another.")
@click.option("--run", "only", metavar="NAME", multiple=True, help="Only this run; may be given again for another.")
@click.option("--output", metavar="PATH", help="A folder, or one file. Default: beside the results.")
@click.option("--list", "show", is_flag=True, help="Print the formats.")
def command(folder: str, formats: tuple[str, ...], only: tuple[str, ...], output: str | None, show: bool) -> int:
    """Write the results of FOLDER, processed before, in the FORMAT of another program.

    The same files come out of `vidtrack run` where config.yaml lists the format under `export`.
    """
    from vidtrack.exchange.formats import FORMATS

    if show:
        from vidtrack.settings.exports import ABOUT

        for name, about in ABOUT.items():
            click.echo(f"{name:<11} {about}")
        return 0
    if not formats:
        raise VidtrackError(f"--to FORMAT is missing. There are {', '.join(FORMATS)}.")
    names = list(dict.fromkeys(_known(name) for name in formats))
    output = os.path.abspath(output) if output else None
    with inside(folder):
        settings = settings_here()
        made, left_out = _all(settings, names, tuple(dict.fromkeys(only)))
        for line in left_out:
            click.echo(f"vidtrack: {line}", err=True)
        for path, lines in _save(made, output):
            click.echo(os.path.relpath(path) if output is None else path)
            for line in lines:
                click.echo(f"vidtrack: {line}", err=True)
    return 0


ENDINGS = (".csv", ".parquet", ".nc", ".mat", ".c3d", ".tsv", ".trc", ".mot", ".out", ".yml", ".toml", ".xml", ".txt")
"""By which a path is meant to be a file."""

Made = list[tuple[str, list[str], "Written"]]
"""For each thing written: where beside the results it lies by default, its files' places there, what was written."""


def _known(name: str) -> str:
    from vidtrack.exchange.formats import FORMATS
    from vidtrack.naming import hint_of
    from vidtrack.settings.exports import OTHER_NAMES, known_name

    known = known_name(name)
    if known not in FORMATS:
        there = hint_of(name, [*FORMATS, *OTHER_NAMES], f"there are {', '.join(FORMATS)}.")
        raise VidtrackError(f"--to {name}: no such format; {there}")
    return known


def _all(settings: Settings, names: list[str], only: tuple[str, ...]) -> tuple[Made, list[str]]:
    """Everything in memory before anything is written; and why runs are left out that were not asked for by name.

    What cannot be written leaves nothing half done; a run that failed costs the others nothing.
    """
    from vidtrack.exchange.formats import FORMATS, places, written
    from vidtrack.exchange.results import axes_of, read_run, result_paths
    from vidtrack.files.camera_json import located_by
    from vidtrack.files.experiment import within
    from vidtrack.files.outdated_note import is_outdated
    from vidtrack.naming import hint_of

    results = within(settings.experiment, "results")
    runs = _layouts(settings, results)
    for run in only:
        if run not in runs:
            hint = hint_of(run, runs, f"there are {', '.join(runs) or 'none'}.")
            raise VidtrackError(f"--run {run}: no such run; {hint}")
    made: Made = []
    left_out = []
    for name in names:
        reasons = []
        for run in only or runs:
            layout = runs[run]
            if lacking := FORMATS[name].lacking(layout):
                reasons.append(f"run {run} cannot be written as {name}: {lacking}.")
                continue
            axes = axes_of(settings, run)
            paths = result_paths(results, FORMATS[name], layout)
            refined = settings.calibration.self_calibration is not None
            if "cameras" in paths:
                paths["cameras"] = [located_by(os.path.dirname(path), refined) for path in paths["cameras"]]
            if missing := [path for several in paths.values() for path in several if not os.path.isfile(path)]:
                reasons.append(f"{missing[0]}: not there yet, or run {run} failed. Call vidtrack run first.")
                continue
            if old := [path for several in paths.values() for path in several if is_outdated(path)]:
                reasons.append(f"{old[0]}: of an earlier call, not of the present settings. Call vidtrack run first.")
                continue
            answer = written(name, read_run(paths, run, settings.units, axes, layout.mode))
            made.append((os.path.join(results, "runs", run, "export"), places(name, layout), answer))
        if reasons and (only or len(reasons) == len(runs)):
            raise VidtrackError(*reasons)
        left_out += reasons
    if not made:
        raise VidtrackError("runs/: there is no run. Put recordings into runs/<run>/ first.")
    return made, list(dict.fromkeys(left_out))


def _layouts(settings: Settings, results: str) -> dict[str, Layout]:
    """Every run by its name: those that were recorded, and those of which there are results alone."""
    from vidtrack.exchange.results import layout_of
    from vidtrack.files.experiment import Run, look_through

    recorded = look_through(settings)[0].runs
    found = {name: layout_of(settings, run) for name, run in recorded.items()}
    here = os.path.join(results, "runs")
    for name in sorted(os.listdir(here)) if os.path.isdir(here) else []:
        if name not in found:
            tracked = os.path.join(here, name, "centroids")
            files = sorted(os.listdir(tracked)) if os.path.isdir(tracked) else []
            cameras = [file.removesuffix(".parquet") for file in files if file.endswith(".parquet")]
            found[name] = layout_of(settings, Run(name, dict.fromkeys(cameras, ""), None, None, None))
    return found


def _other_ending(output: str, made: Made) -> str:
    """What is wrong with a file's name that has the ending of another format; empty where nothing is."""
    (own,) = (os.path.splitext(name)[1] for _, _, answer in made for name in answer.files)
    ending = os.path.splitext(output)[1].lower()
    if ending == own or ending not in ENDINGS:
        return ""
    return f"--output {os.path.basename(output)}: what is written is a {own} file. Name it so, or choose another --to."


def _save(made: Made, output: str | None) -> list[tuple[str, list[str]]]:
    """Write all; each path with what its reader should know, and only the first path of a run in several files."""
    from vidtrack.files.atomic import replacing

    count = sum(len(answer.files) for _, _, answer in made)
    as_file = output is not None and count == 1 and os.path.splitext(output)[1] != "" and not os.path.isdir(output)
    if (
        output is not None
        and count > 1
        and os.path.splitext(output)[1].lower() in ENDINGS
        and not os.path.isdir(output)
    ):
        raise VidtrackError(f"--output {output}: {count} files do not fit in one. Name a folder, or one run by --run.")
    if as_file and (wrong := _other_ending(str(output), made)):
        raise VidtrackError(wrong)
    by_name: dict[str, bytes] = {}
    clash = any(by_name.setdefault(n, c) != c for _, _, answer in made for n, c in answer.files.items())
    saved = []
    for folder, inner, answer in made:
        lines = list(answer.notes)
        for place in inner:
            path = os.path.join(folder, place) if output is None else output
            if output is not None and not as_file:
                run = os.path.basename(os.path.dirname(folder))
                path = os.path.join(output, *((run, place) if clash else (os.path.basename(place),)))
            with replacing(path) as file:
                file.write(answer.files[os.path.basename(place)])
            saved.append((path, lines))
            lines = []
    return saved

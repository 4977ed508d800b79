"""vidtrack run: Snakemake with one display, and the verdict last."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import click

from vidtrack.commands.folder import FOLDER, NO_COLOR, inside, settings_here
from vidtrack.errors import VidtrackError

if TYPE_CHECKING:
    from vidtrack.running.snakemake import Ended
    from vidtrack.settings.config import Settings

_EXAMPLES = """
\b
Examples:
  vidtrack run my-lab
  vidtrack run my-lab --run pluck --cores 4
  vidtrack run my-lab -- --dry-run      only show what would be done: what
                                        follows -- is for Snakemake
"""


@click.command("run", epilog=_EXAMPLES)
@FOLDER
@click.option("--run", "only", metavar="NAME", help="Only this run, and the calibration that it needs.")
@click.option("--cores", default="all", show_default=True, metavar="N", help="Processor cores used at once.")
@click.option("--yes", is_flag=True, help="Ask nothing: remove the lock of a killed run.")
@NO_COLOR
@click.argument("more", nargs=-1, type=click.UNPROCESSED)
def command(folder: str, only: str | None, cores: str, yes: bool, no_color: bool, more: tuple[str, ...]) -> int:
    """Process what is not done yet in FOLDER. What has been done stays; what a change touches is done again.

    The text of Snakemake is kept in .snakemake/vidtrack.log of the folder.
    """
    from rich.console import Console

    from vidtrack.commands.unlock import free_lock
    from vidtrack.running.snakemake import run_snakemake

    if cores != "all" and not (cores.isdigit() and int(cores)):
        raise VidtrackError(f"--cores {cores}: not a number of cores. Give 1 or more, or all.")
    if other := next((word for word in more[:1] if os.path.isdir(word)), ""):
        raise VidtrackError(f"{other}: one experiment at a time. Call vidtrack run {other} after this one.")
    with inside(folder):
        settings = settings_here()
        if only is not None:
            _check_run(settings, only)
    free_lock(folder, yes)
    console = Console(stderr=True, no_color=no_color or None)
    ended = run_snakemake(folder, cores, console, only=only, more=more)
    lines = ending_lines(ended, folder)
    if only and not ended.code and not {"-n", "--dry-run"} & set(more):
        lines += _verdict_of(folder, only)
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=not console.is_terminal, style=_colour(line))
    return 130 if ended.stopped else ended.code


def _check_run(settings: Settings, name: str) -> None:
    from vidtrack.files.experiment_checks import checked_experiment
    from vidtrack.naming import hint_of

    runs = list(checked_experiment(settings).runs)
    if name not in runs:
        hint = hint_of(name, runs, f"there are {', '.join(runs) or 'none'}.")
        raise VidtrackError(f"no run {name!r}; {hint}")


def ending_lines(ended: Ended, folder: str) -> list[str]:
    """How it ended, in lines for a person; the verdict last."""
    from vidtrack.running.snakemake import LOG

    log = os.path.join(folder, LOG)
    done, total = ended.steps
    said = [_from_here(line, folder) for line in ended.said]
    if ended.stopped:
        kept = f"{done} of {total} jobs were done and are kept" if total else "nothing was done yet"
        said.append(f"stopped: {kept}; what was under way is dropped. vidtrack run goes on from here.")
    elif ended.code and not said:
        said += [*ended.last, f"Snakemake ended with code {ended.code}; its text is in {log}"]
    elif ended.code:
        said.append(f"not everything could be done (above); Snakemake's own text is in {log}")
    elif not total and not said:
        said.append("nothing to do: everything is up to date")
    return said


def _from_here(line: str, folder: str) -> str:
    """A line of the workflow, which works in `folder`; the path of the report as seen from where the user is."""
    path = line.removeprefix("report: ")
    return line if path == line else f"report: {os.path.normpath(os.path.join(folder, path))}"


def _verdict_of(folder: str, run: str) -> list[str]:
    """The verdict of one run and its calibration, judged by the stage; nothing is written."""
    from vidtrack.files.experiment_checks import checked_experiment
    from vidtrack.files.results_files import read_results
    from vidtrack.stages.verdict import verdict
    from vidtrack.verdict.judgement import terminal_lines
    from vidtrack.workflow import report_orders

    with inside(folder):
        settings = settings_here()
        experiment = checked_experiment(settings)
        found = []
        for part in ("calibration", f"runs/{run}"):
            for here, _, names in os.walk(os.path.join(experiment.results, part)):
                found += [os.path.join(here, n) for n in sorted(names) if _judged(here, n)]
        asked = report_orders.verdict(settings, experiment)["runs"]
        record = verdict(read_results(found), {run: asked[run]})
    lines = [line.removeprefix("vidtrack: ") for line in terminal_lines(record)]
    return [*lines, "report.html covers all runs: vidtrack run without --run writes it"]


def _judged(here: str, name: str) -> bool:
    """Whether the verdict reads a file of the results."""
    return name in ("points.parquet", "trajectories.parquet") or (name.endswith(".json") and name != "alone.json")


def _colour(line: str) -> str:
    word = line.split(": ")[1] if line.count(": ") else ""
    word = word.split(":")[0]
    return {"good": "green", "doubtful": "yellow", "bad": "red", "failed": "red"}.get(word, "")

"""vidtrack check: what will happen with an experiment, and what is wrong with it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import click

from vidtrack.commands.folder import FOLDER, NO_COLOR, inside, settings_here
from vidtrack.commands.lines import say
from vidtrack.errors import VidtrackError

if TYPE_CHECKING:
    from vidtrack.files.experiment import Experiment
    from vidtrack.settings.config import Settings

_EXAMPLES = """
\b
Examples:
  vidtrack check my-lab
  vidtrack check            the folder that you are in
  vidtrack check my-lab --no-color > check.txt
"""


@click.command("check", epilog=_EXAMPLES)
@FOLDER
@NO_COLOR
def command(folder: str, no_color: bool) -> int:
    """Read every input of FOLDER, decode a few pictures of each, and say what will come of it and what is wrong.

    Nothing is processed and nothing is written. Exit code 1 where something would be refused.
    """
    from rich.console import Console

    from vidtrack.files.experiment import awaited_runs
    from vidtrack.files.experiment_checks import checked_experiment
    from vidtrack.findings import worst_first
    from vidtrack.preview.survey import survey
    from vidtrack.verdict.judgement import not_recorded, sentence

    console = Console(stderr=True, no_color=no_color or None)
    with inside(folder):
        settings = settings_here()
        try:
            experiment = checked_experiment(settings)
            _check_exports(settings, experiment)
        except VidtrackError as error:
            for problem in error.problems:
                say(f"refused: {problem}")
            say(_refusals(len(error.problems)))
            return 1
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        with console.status("looking") as status:
            found = survey(settings, experiment, cores, lambda what: status.update(f"looking at {what}"))
    for about, what in found.facts:
        say(f"{about}: {what}")
    words = {"failed": "refused", "bad": "bad", "doubtful": "doubtful", "note": "note"}
    for finding in worst_first(dict.fromkeys(found.findings)):
        say(f"{words[finding.level]}: {sentence(finding.text)} {sentence(finding.cure)}".rstrip())
    if awaited := awaited_runs(settings, experiment):
        say(f"note: {not_recorded(awaited)}")
    refused = sum(finding.level == "failed" for finding in found.findings)
    if refused:
        say(_refusals(refused))
    return 1 if refused else 0


def _check_exports(settings: Settings, experiment: Experiment) -> None:
    """Refuse what `export` asks for and no run can give, as the workflow does."""
    if settings.export or any(run.export for run in settings.runs.values()):
        from vidtrack.exchange.results import unsuited

        if problems := unsuited(settings, experiment.runs.values()):
            raise VidtrackError(*problems)


def _refusals(n: int) -> str:
    return "1 thing would be refused." if n == 1 else f"{n} things would be refused."

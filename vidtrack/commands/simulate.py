"""vidtrack simulate: a whole experiment, rendered from a scenario."""

from __future__ import annotations

import click

_EXAMPLES = """
\b
Examples:
  vidtrack simulate tutorial studio      the films of the tutorial
  vidtrack simulate my-rig.yaml my-lab --seed 2
  vidtrack simulate demo nowhere --list   only says which files it would write
"""


@click.command("simulate", epilog=_EXAMPLES)
@click.argument("scenario", type=click.Path(dir_okay=False))
@click.argument("folder", type=click.Path(file_okay=False))
@click.option("--list", "only_list", is_flag=True, help="Only say which files it would write.")
@click.option("--seed", type=int, metavar="N", help="Other random numbers than the scenario's.")
@click.option(
    "--threads", type=click.IntRange(1), metavar="N", help="Files written at once; default: one a processor core."
)
def command(scenario: str, folder: str, only_list: bool, seed: int | None, threads: int | None) -> int:
    """Render the experiment FOLDER that a SCENARIO describes: films, survey, picks, reference, truth.

    SCENARIO is a YAML file, or one that comes with vidtrack: tutorial, demo, float, tank, wand, action.
    """
    from vidtrack.simulate.__main__ import main as simulate
    from vidtrack.workflow.shipped import SCENARIOS, example_or_file

    more = ["--list"] if only_list else []
    more += [] if seed is None else ["--seed", str(seed)]
    more += [] if threads is None else ["--threads", str(threads)]
    return simulate([*more, "--", example_or_file(scenario, SCENARIOS), folder])

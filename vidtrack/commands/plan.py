"""vidtrack plan."""

from __future__ import annotations

import click

_EXAMPLES = """
\b
Example:
  vidtrack plan thesis predicted        the rig of data/sensitivity/thesis.yaml, which comes with vidtrack
"""


@click.command("plan", epilog=_EXAMPLES)
@click.argument("plan", type=click.Path(dir_okay=False))
@click.argument("folder", type=click.Path(file_okay=False))
def command(plan: str, folder: str) -> int:
    """Predict what accuracy the rig of a PLAN will have, and write tables and figures to FOLDER."""
    from vidtrack.jobs.sensitivity import main as predict
    from vidtrack.workflow.shipped import PLANS, example_or_file

    return predict([example_or_file(plan, PLANS), folder])

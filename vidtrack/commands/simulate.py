"""vidtrack simulate."""

from __future__ import annotations

import click


@click.command(
    "simulate", context_settings={"ignore_unknown_options": True, "help_option_names": []}, add_help_option=False
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED)
def command(arguments: tuple[str, ...]) -> int:
    """Render the experiment FOLDER that a SCENARIO describes."""
    from vidtrack.simulate.__main__ import main as simulate

    return simulate(arguments)
